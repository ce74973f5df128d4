#include "core/transport/directional_grid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/base/angle.h"

namespace relit {
namespace {

using kernels::DirectionalColour;
using kernels::DirectionalTerms;

constexpr int square_side = 8;  // texels whose sums are made together
static_assert(square_side * square_side == kernels::group_points);
constexpr int most_lanes = 16;

DirectionalColour colour_of(const scatter::DirectionalDipole& m) {
    return {.diffusion = float(m.diffusion),
            .sigma_tr = float(m.sigma_tr),
            .extrapolation = float(m.extrapolation),
            .mirrored = float(m.mirrored),
            .edge = float(m.edge_step * m.edge_step),
            .nearest = float(m.nearest * m.nearest),
            .fluence = float(m.norm * m.c_phi / m.diffusion),
            .ray = float(3 * m.norm * m.c_phi),
            .turn = float(3 * m.norm * m.diffusion * m.c_e),
            .plain = float(m.norm * m.c_e)};
}

const float* texel(const Image& image, int i, int j) {
    return image.row(j).data() + std::size_t(i) * image.channels;
}

Vec3 vector_at(const Image& image, int i, int j) {
    const float* v = texel(image, i, j);
    return {v[0], v[1], v[2]};
}

// How much longer a cell is along its slope than across it.
double stretch_of(const float* slopes) {
    return std::sqrt(1 + double(slopes[0]) * slopes[0] + double(slopes[1]) * slopes[1]);
}

// `texels` gets the place of every sample.
DirectionalTree tree_of(const DirectionalSurface& surface, std::vector<std::uint32_t>& texels,
                        const std::stop_token& stop) {
    SurfaceSamples samples;
    std::vector<Vec3> normals;
    const int width = surface.z.width, height = surface.z.height;
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) {
            if (!(surface.area.at(i, j) > 0)) continue;
            texels.push_back(std::uint32_t(j) * width + i);
            samples.x.push_back(float((i + 0.5) * surface.spacing));
            samples.y.push_back(float((height - 0.5 - j) * surface.spacing));
            samples.z.push_back(surface.z.at(i, j));
            samples.area.push_back(surface.area.at(i, j));
            normals.push_back(vector_at(surface.normals, i, j));
        }
    return {samples, normals, stop};
}

}  // namespace

struct DirectionalGrid::Light {
    DirectionalTree::Light in_tree;
    Texels planes;  // w_12, then flux
    DirectionalTerms terms{};
};

struct DirectionalGrid::Scratch {
    std::vector<float> sources, row;
    std::array<float, kernels::max_directional_numbers * kernels::group_points> group{};
};

DirectionalGrid::DirectionalGrid(DirectionalSurface surface,
                                 const std::array<scatter::DirectionalDipole, 3>& dipoles,
                                 const DirectionalRule& rule, const Executor& executor,
                                 const std::stop_token& stop, Simd simd)
    : surface_(std::move(surface)), tree_(tree_of(surface_, texels_, stop)) {
    double fall = dipoles[0].sigma_tr;
    for (int c = 0; c < 3; ++c) {
        colours_[c] = colour_of(dipoles[c]);
        bend_.depth += colours_[c].extrapolation * colours_[c].extrapolation / 3;
        bend_.height += colours_[c].mirrored * colours_[c].mirrored / 3;
        fall = std::min(fall, dipoles[c].sigma_tr);
    }
    const double texel = surface_.spacing * surface_.spacing;
    cells_.resize(3);
    parallel_rows(executor, 3, stop, [&](RowRange colours) {
        for (int c = colours.begin; c < colours.end; ++c)
            cells_[c] = DirectionalCell(dipoles[c], texel);
    });
    constexpr double least = 14;  // e^-14 is a millionth
    opening_ = {.area = rule.area,
                .cone_cosine = float(std::cos(radians(rule.cone_deg))),
                .height = bend_.height,
                .near = float(texel * rule.near_texels * rule.near_texels),
                .range = float(std::min(least / fall, 1e9))};
    set_taps(rule);
    set_planes();
    switch (simd) {
#if defined(__x86_64__)
        case Simd::avx512:
            sum_group_ = kernels::directional_group_avx512;
            sum_row_ = kernels::directional_row_avx512;
            break;
        case Simd::avx2:
            sum_group_ = kernels::directional_group_avx2;
            sum_row_ = kernels::directional_row_avx2;
            break;
#endif
        default:
            sum_group_ = kernels::directional_group_portable;
            sum_row_ = kernels::directional_row_portable;
    }
}

// Midpoints of n x n parts of the cells around, without the texel's own.
void DirectionalGrid::set_taps(const DirectionalRule& rule) {
    const double texel = surface_.spacing;
    margin_ = int(rule.near_texels);
    stride_ = surface_.z.width + 2 * margin_ + most_lanes;
    for (int v = -margin_; v <= margin_; ++v)
        for (int u = -margin_; u <= margin_; ++u) {
            const int squared = u * u + v * v;
            if (squared == 0 || squared >= rule.near_texels * rule.near_texels) continue;
            const int parts = squared <= 2 ? rule.touching : rule.near;
            for (int q = 0; q < parts; ++q)
                for (int p = 0; p < parts; ++p) {
                    const double right = texel * ((p + 0.5) / parts - 0.5);
                    const double up = texel * ((q + 0.5) / parts - 0.5);
                    taps_.push_back({.offset = v * stride_ + u,
                                     .x = float(-(texel * u + right)),
                                     .y = float(texel * v - up),
                                     .right = float(right),
                                     .up = float(up),
                                     .weight = 1.0f / float(parts * parts)});
                }
        }
}

void DirectionalGrid::set_planes() {
    const int width = surface_.z.width, height = surface_.z.height;
    plane_ = std::size_t(height + 2 * margin_) * stride_;
    planes_.assign(6 * plane_, 0.0f);
    std::fill_n(&planes_[3 * plane_], plane_, 1.0f);
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) {
            if (!(surface_.area.at(i, j) > 0)) continue;
            const float* n = texel(surface_.normals, i, j);
            const float* slope = texel(surface_.slopes, i, j);
            const float numbers[] = {surface_.z.at(i, j), n[0], n[1], n[2], slope[0], slope[1]};
            for (int k = 0; k < 6; ++k) planes_[k * plane_ + place(i, j)] = numbers[k];
        }
}

DirectionalGrid::Light DirectionalGrid::light(const Image& flux, const Image& inward) const {
    Light light;
    std::vector<float> of_samples(texels_.size() * 3), ways(texels_.size() * 3);
    light.planes.assign(6 * plane_, 0.0f);
    for (std::size_t k = 0; k < texels_.size(); ++k) {
        const int i = int(texels_[k] % flux.width), j = int(texels_[k] / flux.width);
        const float* f = texel(flux, i, j);
        if (f[0] == 0 && f[1] == 0 && f[2] == 0) continue;
        const float* w = texel(inward, i, j);
        for (int c = 0; c < 3; ++c) {
            of_samples[3 * k + c] = f[c];
            ways[3 * k + c] = w[c];
            light.planes[c * plane_ + place(i, j)] = w[c];
            light.planes[(3 + c) * plane_ + place(i, j)] = f[c];
        }
    }
    light.in_tree = tree_.light(of_samples, ways);
    return light;
}

// What is far from the texels of the square at (left, top).
void DirectionalGrid::add_group(int left, int top, const Light& light, Scratch& scratch,
                                Image& out) const {
    kernels::DirectionalPoints points;
    int places[kernels::group_points], count = 0;
    for (int j = top; j < std::min(top + square_side, out.height); ++j)
        for (int i = left; i < std::min(left + square_side, out.width); ++i)
            if (surface_.area.at(i, j) > 0) places[count++] = j * out.width + i;
    if (count == 0) return;
    for (int k = 0; k < kernels::group_points; ++k) {
        const int at = places[k < count ? k : 0], i = at % out.width, j = at / out.width;
        points.at.x[k] = float((i + 0.5) * surface_.spacing);
        points.at.y[k] = float((out.height - 0.5 - j) * surface_.spacing);
        points.at.z[k] = surface_.z.at(i, j);
        const float* n = texel(surface_.normals, i, j);
        points.normal_x[k] = n[0], points.normal_y[k] = n[1], points.normal_z[k] = n[2];
    }
    tree_.gather(light.in_tree, points.at, opening_, scratch.sources);
    scratch.group.fill(0);
    sum_group_(colours_.data(), bend_, light.terms, opening_.near, points, scratch.sources.data(),
               int(scratch.sources.size()) / kernels::directional_source_floats,
               scratch.group.data());
    for (int k = 0; k < count; ++k)
        for (int n = 0; n < out.channels; ++n)
            out.values[std::size_t(places[k]) * out.channels + n] +=
                scratch.group[n * kernels::group_points + k];
}

void DirectionalGrid::add_near(int row, const Light& light, Scratch& scratch, Image& out) const {
    const auto fixed = [&](int k) { return planes_.data() + k * plane_; };
    const auto lit = [&](int k) { return light.planes.data() + k * plane_; };
    const kernels::DirectionalPlanes planes{
        fixed(0), fixed(1), fixed(2), fixed(3), fixed(4),
        fixed(5), lit(0),   lit(1),   lit(2),   {lit(3), lit(4), lit(5)}};
    const int padded = out.width + most_lanes;
    scratch.row.assign(std::size_t(out.channels) * padded, 0);
    sum_row_(colours_.data(), light.terms, planes, place(0, row), out.width, taps_.data(),
             int(taps_.size()), scratch.row.data(), padded);
    for (int i = 0; i < out.width; ++i)
        for (int n = 0; surface_.area.at(i, row) > 0 && n < out.channels; ++n)
            out.at(i, row, n) += scratch.row[std::size_t(n) * padded + i];
}

void DirectionalGrid::add_own(int row, const Image& flux, const Image& inward, Image& out) const {
    for (int i = 0; i < out.width; ++i) {
        const double area = surface_.area.at(i, row);
        if (!(area > 0)) continue;
        const Vec3 normal = vector_at(surface_.normals, i, row), w = vector_at(inward, i, row);
        const double down = -dot(w, normal), stretch = stretch_of(texel(surface_.slopes, i, row));
        for (int c = 0; c < 3; ++c) {
            const double f = flux.at(i, row, c);
            if (f == 0) continue;
            const DirectionalCell::Mean mean = cells_[c].at(down, area, stretch);
            if (out.channels == 3) {
                out.at(i, row, c) += float(f * (mean.constant + mean.normal));
                continue;
            }
            const Vec3 gradient = mean.normal * normal + mean.along * (w + down * normal);
            const double numbers[] = {mean.constant, gradient.x, gradient.y, gradient.z};
            for (int n = 0; n < 4; ++n) out.at(i, row, 4 * c + n) += float(f * numbers[n]);
        }
    }
}

Image DirectionalGrid::sums(DirectionalTerms terms, const Image& flux, const Image& inward,
                            const Executor& executor, const std::stop_token& stop) const {
    assert(flux.width == surface_.z.width && flux.height == surface_.z.height);
    assert(flux.channels == 3 && inward.channels == 3);
    Light lit = light(flux, inward);
    lit.terms = terms;
    Image out(flux.width, flux.height, numbers_of(terms));
    const int bands = (flux.height + square_side - 1) / square_side;
    parallel_rows(executor, bands, stop, [&](RowRange range) {
        Scratch scratch;
        for (int band = range.begin; band < range.end; ++band) {
            const int top = band * square_side;
            for (int i = 0; i < flux.width; i += square_side) add_group(i, top, lit, scratch, out);
            for (int j = top; j < std::min(top + square_side, flux.height); ++j) {
                add_near(j, lit, scratch, out);
                add_own(j, flux, inward, out);
            }
        }
    });
    return out;
}

std::uint64_t DirectionalGrid::bytes() const {
    return planes_.size() * sizeof(float) + bytes_of(surface_) +
           texels_.size() * sizeof(std::uint32_t) + tree_.bytes();
}

}  // namespace relit
