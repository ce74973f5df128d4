#include "core/light/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>
#include <tuple>
#include <utility>

#include "core/base/angle.h"
#include "core/base/rect.h"

namespace relit {
namespace {

constexpr double pi = std::numbers::pi;
// `auto` gives an open plane under a uniform sky 0.4 (section 6).
constexpr double auto_exposure = 1.6;

// A rotation of many directions.
struct Turn {
    double cy, sy, cp, sp;

    explicit Turn(Rotation rotation)
        : cy(std::cos(radians(rotation.yaw_deg))),
          sy(std::sin(radians(rotation.yaw_deg))),
          cp(std::cos(radians(rotation.pitch_deg))),
          sp(std::sin(radians(rotation.pitch_deg))) {}

    Vec3 operator()(Vec3 d) const {
        const Vec3 yawed{cy * d.x + sy * d.z, d.y, cy * d.z - sy * d.x};
        return {yawed.x, cp * yawed.y - sp * yawed.z, sp * yawed.y + cp * yawed.z};
    }
};

double latitude(int j, int height) { return pi * (0.5 - (j + 0.5) / height); }

Rgb colour_at(const Image& map, int i, int j) {
    const float* texel = &map.row(j)[std::size_t(i) * 3];
    return {texel[0], texel[1], texel[2]};
}

// Weight of a texel of each row; over the whole map they sum to 1.
std::vector<double> row_weights(const Image& map, Weighting weighting) {
    std::vector<double> weights(map.height, 1.0);
    if (weighting == Weighting::solid_angle)
        for (int j = 0; j < map.height; ++j) weights[j] = std::cos(latitude(j, map.height));
    double sum = 0;
    for (const double w : weights) sum += w * map.width;
    for (double& w : weights) w /= sum;
    return weights;
}

// Sums of importance over rectangles of texels in constant time (a summed-area table).
class ImportanceTable {
public:
    ImportanceTable(const Image& map, const std::vector<double>& weights)
        : stride_(map.width + 1), sums_(std::size_t(stride_) * (map.height + 1)) {
        const double mean = mean_luminance(map);
        for (int j = 0; j < map.height; ++j) {
            double row = 0;
            for (int i = 0; i < map.width; ++i) {
                const double relative = mean > 0 ? luminance(colour_at(map, i, j)) / mean : 0;
                row += weights[j] * 0.5 * (1 + relative);
                sums_[index(i + 1, j + 1)] = sums_[index(i + 1, j)] + row;
            }
        }
    }

    [[nodiscard]] double sum(Rect r) const {
        return sums_[index(r.x + r.width, r.y + r.height)] - sums_[index(r.x, r.y + r.height)] -
               sums_[index(r.x + r.width, r.y)] + sums_[index(r.x, r.y)];
    }

private:
    [[nodiscard]] std::size_t index(int i, int j) const { return std::size_t(j) * stride_ + i; }
    int stride_;
    std::vector<double> sums_;
};

struct Piece {
    double importance = 0;
    Rect rect;
    // The most important piece first; the place decides a tie, so that the order is always the
    // same.
    friend bool operator<(const Piece& a, const Piece& b) {
        return std::tie(a.importance, a.rect.y, a.rect.x) <
               std::tie(b.importance, b.rect.y, b.rect.x);
    }
};

// Cuts a rectangle across its longer side on the sphere where the importance is halved.
std::pair<Rect, Rect> halved(Rect rect, const ImportanceTable& table, const Image& map) {
    const double shrink = std::cos(latitude(rect.y + rect.height / 2, map.height));
    const double across = 2.0 * rect.width / map.width * shrink;
    const bool vertical_cut =
        rect.height == 1 || (rect.width > 1 && across > double(rect.height) / map.height);
    const int size = vertical_cut ? rect.width : rect.height;
    const auto first_part = [&](int n) {
        return vertical_cut ? Rect{rect.x, rect.y, n, rect.height}
                            : Rect{rect.x, rect.y, rect.width, n};
    };
    const double half = 0.5 * table.sum(rect);
    int cut = 1;
    while (cut < size - 1 && table.sum(first_part(cut)) < half) ++cut;
    const Rect second = vertical_cut ? Rect{rect.x + cut, rect.y, rect.width - cut, rect.height}
                                     : Rect{rect.x, rect.y + cut, rect.width, rect.height - cut};
    return {first_part(cut), second};
}

EnvironmentRegion region_of(const Image& map, const std::vector<double>& weights, Rect rect) {
    EnvironmentRegion region;
    Vec3 bright;
    Vec3 all;
    double r = 0, g = 0, b = 0;
    for (int j = rect.y; j < rect.y + rect.height; ++j)
        for (int i = rect.x; i < rect.x + rect.width; ++i) {
            const Rgb c = colour_at(map, i, j);
            const Vec3 direction = environment_direction(i, j, map.width, map.height);
            region.weight += weights[j];
            r += weights[j] * c.r;
            g += weights[j] * c.g;
            b += weights[j] * c.b;
            all = all + weights[j] * direction;
            bright = bright + (weights[j] * luminance(c)) * direction;
        }
    region.radiance = {r, g, b};
    region.direction = normalized(length(bright) > 0 ? bright : all);
    return region;
}

// `whole` cut into at most `count` rectangles, the most important one halved again and again.
std::vector<Rect> median_cut(Rect whole, int count, const ImportanceTable& table,
                             const Image& map) {
    std::priority_queue<Piece> pieces;
    const auto add = [&](Rect rect) {
        // A single texel cannot be halved: it waits at the end of the queue.
        pieces.push({rect.width * rect.height > 1 ? table.sum(rect) : -1, rect});
    };
    add(whole);
    while (int(pieces.size()) < std::min(count, whole.width * whole.height)) {
        const auto [first, second] = halved(pieces.top().rect, table, map);
        pieces.pop();
        add(first);
        add(second);
    }
    std::vector<Rect> rects;
    for (; !pieces.empty(); pieces.pop()) rects.push_back(pieces.top().rect);
    return rects;
}

}  // namespace

Vec3 environment_direction(int i, int j, int width, int height) {
    const double longitude = 2 * pi * ((i + 0.5) / width - 0.5);
    const double phi = latitude(j, height);
    return {-std::sin(longitude) * std::cos(phi), std::sin(phi),
            std::cos(longitude) * std::cos(phi)};
}

Vec3 rotated(Vec3 d, Rotation rotation) { return Turn(rotation)(d); }

double mean_luminance(const Image& map) {
    const std::vector<double> weights = row_weights(map, Weighting::solid_angle);
    double mean = 0;
    for (int j = 0; j < map.height; ++j)
        for (int i = 0; i < map.width; ++i) mean += weights[j] * luminance(colour_at(map, i, j));
    return mean;
}

std::vector<EnvironmentRegion> environment_regions(const Image& map, Weighting weighting,
                                                   EnvironmentSampling sampling) {
    const std::vector<double> weights = row_weights(map, weighting);
    std::vector<EnvironmentRegion> regions;
    if (map.texels() <= std::size_t(sampling.max_texels)) {
        for (int j = 0; j < map.height; ++j)
            for (int i = 0; i < map.width; ++i)
                regions.push_back(region_of(map, weights, {i, j, 1, 1}));
        return regions;
    }
    const ImportanceTable table(map, weights);
    for (const Rect& rect :
         median_cut({0, 0, map.width, map.height}, sampling.regions, table, map)) {
        EnvironmentRegion region = region_of(map, weights, rect);
        if (rect.width * rect.height > 1)
            for (const Rect& part : median_cut(rect, sampling.parts, table, map)) {
                const EnvironmentRegion r = region_of(map, weights, part);
                region.parts.push_back({r.direction, r.radiance, r.weight});
            }
        regions.push_back(std::move(region));
    }
    return regions;
}

std::uint64_t GatheredEnvironment::bytes() const {
    std::uint64_t bytes = regions.size() * sizeof(EnvironmentRegion);
    for (const EnvironmentRegion& region : regions)
        bytes += region.parts.size() * sizeof(SamplePart);
    return bytes;
}

GatheredEnvironment gathered_environment(const Image& map, Weighting weighting,
                                         EnvironmentSampling sampling) {
    return {environment_regions(map, weighting, sampling), mean_luminance(map)};
}

std::vector<LightSample> samples_of(const EnvironmentLight& light, MapExtent extent,
                                    const GatheredEnvironment& gathered, bool with_parts) {
    const double mean = gathered.mean_luminance;
    const double intensity = light.intensity.value_or(mean > 0 ? auto_exposure / mean : 0);
    const Turn turn(light.rotation);
    const auto placed = [&](Vec3 direction) {
        const Vec3 turned = turn(direction);
        if (!light.radius) return turned;
        return Vec3{0.5, 0.5 * extent.y_size, 0} + *light.radius * turned;
    };
    std::vector<LightSample> result;
    result.reserve(gathered.regions.size());
    for (const EnvironmentRegion& region : gathered.regions) {
        LightSample sample{
            placed(region.direction), !light.radius, intensity * region.radiance, region.weight, {}};
        if (with_parts)
            for (const SamplePart& part : region.parts)
                sample.parts.push_back({placed(part.at), intensity * part.radiance, part.weight});
        result.push_back(std::move(sample));
    }
    return result;
}

}  // namespace relit
