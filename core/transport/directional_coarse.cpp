#include "core/transport/directional_coarse.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace relit {
namespace {

int coarse_size(int size, int factor) { return (size + factor - 1) / factor; }

// Calls `visit(i, j)` for the texels that coarse texel (u, v) stands for.
template <class Visit>
void for_each_texel(int width, int height, int u, int v, int factor, const Visit& visit) {
    for (int j = v * factor; j < std::min((v + 1) * factor, height); ++j)
        for (int i = u * factor; i < std::min((u + 1) * factor, width); ++i) visit(i, j);
}

const float* texel(const Image& image, int i, int j) {
    return image.row(j).data() + std::size_t(i) * image.channels;
}

void set_vector(Image& image, int i, int j, Vec3 v) {
    float* out = &image.at(i, j);
    out[0] = float(v.x), out[1] = float(v.y), out[2] = float(v.z);
}

// Between which coarse texels a fine one lies, and how near the second.
struct Between {
    int first, second;
    float share;

    Between(int fine, int factor, int size) {
        const float place = (float(fine) + 0.5f) / float(factor) - 0.5f;
        const float below = std::floor(place);
        first = std::clamp(int(below), 0, size - 1);
        second = std::clamp(int(below) + 1, 0, size - 1);
        share = place - below;
    }
};

// Sums of coarse texels and their weight, which is 0 where nothing is.
constexpr int sums_size = kernels::max_directional_numbers, padded_size = 16;

void blend_rows(const Image& sums, const Image& area, const Between& rows, float* out) {
    for (int u = 0; u < sums.width; ++u, out += padded_size) {
        const float above = area.at(u, rows.first) > 0 ? 1 - rows.share : 0;
        const float below = area.at(u, rows.second) > 0 ? rows.share : 0;
        const float* const a = texel(sums, u, rows.first);
        const float* const b = texel(sums, u, rows.second);
        for (int n = 0; n < sums_size; ++n) out[n] = above * a[n] + below * b[n];
        out[sums_size] = above + below;
    }
}

}  // namespace

DirectionalSurface coarse_surface(const DirectionalSurface& surface, int factor,
                                  const Executor& executor) {
    const int width = coarse_size(surface.z.width, factor);
    const int height = coarse_size(surface.z.height, factor);
    DirectionalSurface coarse{factor * surface.spacing, Image(width, height, 1),
                              Image(width, height, 1), Image(width, height, 2),
                              Image(width, height, 3)};
    parallel_rows(executor, height, {}, [&](RowRange rows) {
        for (int v = rows.begin; v < rows.end; ++v)
            for (int u = 0; u < width; ++u) {
                double area = 0, z = 0, right = 0, up = 0;
                Vec3 normal;
                for_each_texel(surface.z.width, surface.z.height, u, v, factor, [&](int i, int j) {
                    const double a = surface.area.at(i, j);
                    const float* n = texel(surface.normals, i, j);
                    area += a;
                    z += a * surface.z.at(i, j);
                    right += a * surface.slopes.at(i, j, 0);
                    up += a * surface.slopes.at(i, j, 1);
                    normal = normal + a * Vec3{n[0], n[1], n[2]};
                });
                coarse.area.at(u, v) = float(area);
                set_vector(coarse.normals, u, v, normalized(normal));
                if (!(area > 0)) continue;
                coarse.z.at(u, v) = float(z / area);
                coarse.slopes.at(u, v, 0) = float(right / area);
                coarse.slopes.at(u, v, 1) = float(up / area);
            }
    });
    return coarse;
}

DirectionalLight coarse_light(const Image& flux, const Image& inward, int factor,
                              const Executor& executor, const std::stop_token& stop) {
    const int width = coarse_size(flux.width, factor), height = coarse_size(flux.height, factor);
    DirectionalLight coarse{Image(width, height, 3), Image(width, height, 3)};
    parallel_rows(executor, height, stop, [&](RowRange rows) {
        for (int v = rows.begin; v < rows.end; ++v)
            for (int u = 0; u < width; ++u) {
                Vec3 sum, way;
                for_each_texel(flux.width, flux.height, u, v, factor, [&](int i, int j) {
                    const float *f = texel(flux, i, j), *w = texel(inward, i, j);
                    const double weight = double(f[0]) + f[1] + f[2];
                    if (weight == 0) return;
                    sum = sum + Vec3{f[0], f[1], f[2]};
                    way = way + weight * Vec3{w[0], w[1], w[2]};
                });
                const double weight = sum.x + sum.y + sum.z;
                if (!(weight > 0)) continue;
                set_vector(coarse.flux, u, v, sum);
                set_vector(coarse.inward, u, v, (1 / weight) * way);
            }
    });
    return coarse;
}

Image with_fine_normals(const Image& sums, const Image& coarse_area,
                        const DirectionalSurface& surface, int factor, const Executor& executor,
                        const std::stop_token& stop) {
    Image out(surface.z.width, surface.z.height, 3);
    std::vector<Between> columns;
    for (int i = 0; i < out.width; ++i) columns.emplace_back(i, factor, sums.width);
    parallel_rows(executor, out.height, stop, [&](RowRange rows) {
        std::vector<float> row(std::size_t(sums.width) * padded_size);
        for (int j = rows.begin; j < rows.end; ++j) {
            blend_rows(sums, coarse_area, Between(j, factor, sums.height), row.data());
            for (int i = 0; i < out.width; ++i) {
                if (!(surface.area.at(i, j) > 0)) continue;
                const float* const n = texel(surface.normals, i, j);
                const float* const a = &row[std::size_t(columns[i].first) * padded_size];
                const float* const b = &row[std::size_t(columns[i].second) * padded_size];
                const float right = columns[i].share, left = 1 - right;
                const float inverse = 1 / (left * a[sums_size] + right * b[sums_size]);
                for (int c = 0; c < 3; ++c) {
                    const auto number = [&](int k) {
                        return left * a[4 * c + k] + right * b[4 * c + k];
                    };
                    const float sum =
                        number(0) + n[0] * number(1) + n[1] * number(2) + n[2] * number(3);
                    out.at(i, j, c) = std::max(inverse * sum, 0.0f);
                }
            }
        }
    });
    return out;
}

}  // namespace relit
