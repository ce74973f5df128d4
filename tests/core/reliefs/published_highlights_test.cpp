// Yu, Liu, Hu 2019, table of highlights on the Stanford bunny: what of its orderings a relief of the
// bunny shows (translucency, section 5.4). Prints the table; tests/reference/README.md has it beside
// the published one.
#include <gtest/gtest.h>

#include <cstdio>

#include "core/base/angle.h"
#include "core/field/normals.h"
#include "core/scatter/highlight.h"
#include "core/scatter/lobes.h"
#include "core/transport/transport.h"
#include "tests/support/relief_files.h"

namespace relit::test {
namespace {

using scatter::LobeKind;

constexpr double relief = 0.655;  // the model's own proportions
constexpr double object_height = 0.84;
constexpr double optical_height = 0.4;  // sigma times the height of the bunny
constexpr double brightest = 0.35, counted = 0.20;
// Material of the lower left silhouette, breast to belly, which faces away from the light.
constexpr Rect window{66, 330, 60, 64};

// Light (85, 85): nearly in the plane of the picture, from above.
Vec3 to_light() {
    const double angle = radians(85);
    return {std::sin(angle) * std::cos(angle), std::sin(angle) * std::sin(angle), std::cos(angle)};
}

struct Highlights {
    std::vector<double> local, carried;  // of all material
    std::vector<double> local_in_window, carried_in_window;
};

class Bunny {
public:
    Bunny() : field_(load_relief(relief_files[0])) {
        const int width = field_.width(), height = field_.height();
        surface_ = {Image(width, height, 1), Image(width, height, 1)};
        for (int j = 0; j < height; ++j)
            for (int i = 0; i < width; ++i) {
                surface_.z.at(i, j) = float(relief * field_.heights.at(i, j));
                if (field_.is_solid(i, j))
                    surface_.area.at(i, j) = float(1 / (normal(i, j).z * width * width));
            }
    }

    [[nodiscard]] Highlights highlights(const scatter::Lobe& lobe) const {
        const int width = field_.width(), height = field_.height();
        Image flux(width, height, 1), local(width, height, 1);
        for (int j = 0; j < height; ++j)
            for (int i = 0; i < width; ++i) {
                if (!field_.is_solid(i, j)) continue;
                const scatter::Frame frame = scatter::highlight_frame(normal(i, j));
                local.at(i, j) = float(scatter::value(lobe, frame, to_light(), {0, 0, 1}));
                flux.at(i, j) = local.at(i, j) * surface_.area.at(i, j);
            }
        const RadialProfile profile[] = {
            radial_profile(scatter::HighlightFalloff{optical_height / object_height})};
        const RadialKernel kernel(profile, surface_.spacing(), surface_.extent());
        const Image carried =
            transported(surface_, flux, kernel, TransportAccuracy::exact, executor());
        Highlights result;
        for (int j = 0; j < height; ++j)
            for (int i = 0; i < width; ++i) {
                if (!field_.is_solid(i, j)) continue;
                result.local.push_back(local.at(i, j));
                result.carried.push_back(carried.at(i, j));
                if (i < window.x || j < window.y || i >= window.x + window.width ||
                    j >= window.y + window.height)
                    continue;
                result.local_in_window.push_back(local.at(i, j));
                result.carried_in_window.push_back(carried.at(i, j));
            }
        return result;
    }

private:
    [[nodiscard]] Vec3 normal(int i, int j) const {
        return normal_from(slopes_at(field_, relief, i, j));
    }

    HeightField field_;
    TransportSurface surface_;
};

// The 99.9th percentile: a maximum that single texels do not make.
double maximum(std::vector<double> values) {
    const auto place = values.begin() + std::ptrdiff_t(0.999 * double(values.size()));
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

double variation(const std::vector<double>& values) {
    double sum = 0, squares = 0;
    for (const double v : values) sum += v, squares += v * v;
    const double mean = sum / double(values.size());
    return std::sqrt(std::max(squares / double(values.size()) - mean * mean, 0.0)) / mean;
}

// "Numbers" and "intensity": how many texels are above 0.20, and their mean.
struct Counted {
    int numbers = 0;
    double intensity = 0;
};

Counted count(const std::vector<double>& values, double scale) {
    Counted result;
    for (const double v : values)
        if (v * scale > counted) {
            ++result.numbers;
            result.intensity += v * scale;
        }
    if (result.numbers > 0) result.intensity /= result.numbers;
    return result;
}

struct Set {
    double n_t, n_b;
};

// One scale for all four sets of a method: `common`.
void expect_orderings(const Bunny& bunny, LobeKind kind, const char* name) {
    constexpr Set sets[] = {{2, 2}, {2, 10}, {10, 2}, {10, 10}};
    std::vector<Highlights> of_sets;
    double most_local = 0, most_carried = 0;
    for (const Set& set : sets) {
        of_sets.push_back(bunny.highlights({.kind = kind, .n_t = set.n_t, .n_b = set.n_b}));
        most_local = std::max(most_local, maximum(of_sets.back().local));
        most_carried = std::max(most_carried, maximum(of_sets.back().carried));
    }
    Counted local[4], carried[4];
    for (int k = 0; k < 4; ++k) {
        local[k] = count(of_sets[k].local_in_window, brightest / most_local);
        carried[k] = count(of_sets[k].carried_in_window, brightest / most_carried);
        std::printf("%-10s (%2g,%2g)  proposed %5d %.4f  traditional %5d %.4f  of %zu texels\n",
                    name, sets[k].n_t, sets[k].n_b, carried[k].numbers, carried[k].intensity,
                    local[k].numbers, local[k].intensity, of_sets[k].local_in_window.size());
        EXPECT_GE(carried[k].numbers, local[k].numbers) << "T1, set " << k + 1;
        EXPECT_LT(variation(of_sets[k].carried), variation(of_sets[k].local)) << "set " << k + 1;
    }
    EXPECT_EQ(local[3].numbers, 0) << "T3";
    EXPECT_GT(carried[3].intensity, carried[0].intensity) << "T2";
}

TEST(PublishedHighlights, OfWardAreOrderedAsPublished) {
    RELIT_SKIP_WITHOUT_DATA(relief_files[0].heights);
    expect_orderings(Bunny(), LobeKind::ward, "Ward");
}

TEST(PublishedHighlights, OfAshikhminAreOrderedAsPublished) {
    RELIT_SKIP_WITHOUT_DATA(relief_files[0].heights);
    expect_orderings(Bunny(), LobeKind::ashikhmin, "Ashikhmin");
}

}  // namespace
}  // namespace relit::test
