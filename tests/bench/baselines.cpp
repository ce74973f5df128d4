#include "tests/bench/baselines.h"

#include <algorithm>
#include <cmath>

namespace relit::bench {
namespace {

struct Start {
    float u, v, z;  // texel coordinates of Solid, scene units
};

Start start_of(const Solid& solid, int i, int j, double depth) {
    return {float(i + 1), float(j + 1), solid.z.at(i + 1, j + 1) - float(depth)};
}

float nearest(const Solid& solid, float u, float v) {
    if (u < 0.5f || v < 0.5f || u > solid.width + 0.5f || v > solid.height + 0.5f) return 0;
    return solid.z.at(int(u + 0.5f), int(v + 0.5f));
}

float bilinear(const Solid& solid, float u, float v) {
    if (u < 0.5f || v < 0.5f || u > solid.width + 0.5f || v > solid.height + 0.5f) return 0;
    const int i = int(u), j = int(v);
    const float a = u - float(i), b = v - float(j);
    const float* upper = &solid.z.row(j)[i];
    const float* lower = &solid.z.row(j + 1)[i];
    const float above = upper[0] + a * (upper[1] - upper[0]);
    return above + b * (lower[0] + a * (lower[1] - lower[0]) - above);
}

template <class Shade>
void for_each_texel(const Solid& solid, const Executor& executor, Image& d, const Shade& shade) {
    parallel_rows(executor, solid.height, {}, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < solid.width; ++i) d.at(i, j) = shade(i, j);
    });
}

}  // namespace

void march_thesis(const Solid& solid, Vec3 light, double depth, int steps, const Executor& executor,
                  Image& d) {
    const float lu = float(solid.u_of(light.x)), lv = float(solid.v_of(light.y)),
                lz = float(light.z);
    for_each_texel(solid, executor, d, [&](int i, int j) {
        const Start p = start_of(solid, i, j, depth);
        const float du = (lu - p.u) / float(steps), dv = (lv - p.v) / float(steps),
                    dz = (lz - p.z) / float(steps);
        int s = 1;
        for (int k = 0; k <= steps; ++k)
            s += p.z + float(k) * dz < nearest(solid, p.u + float(k) * du, p.v + float(k) * dv);
        return 1.0f / float(s);
    });
}

void march_per_texel(const Solid& solid, Vec3 light, double depth, bool stop_at_top,
                     const Executor& executor, Image& d) {
    const float lu = float(solid.u_of(light.x)), lv = float(solid.v_of(light.y)),
                lz = float(light.z);
    for_each_texel(solid, executor, d, [&](int i, int j) {
        const Start p = start_of(solid, i, j, depth);
        const float distance = std::hypot(lu - p.u, lv - p.v);
        const int steps = std::max(1, int(std::ceil(distance)));
        const float du = (lu - p.u) / float(steps), dv = (lv - p.v) / float(steps),
                    dz = (lz - p.z) / float(steps);
        int last = steps;
        if (stop_at_top && dz > 0) last = std::min(last, int((float(solid.top_z) - p.z) / dz) + 1);
        int inside = 0;
        for (int k = 0; k < last; ++k)
            inside +=
                p.z + float(k) * dz < bilinear(solid, p.u + float(k) * du, p.v + float(k) * dv);
        const float step_length = std::hypot(std::hypot(du, dv) / float(solid.width), dz);
        const float r = float(inside) * step_length;
        return r > float(depth) ? float(depth) / r : 1.0f;
    });
}

float march_sky_per_texel(const Solid& solid, std::span<const Vec3> directions, double depth, int i,
                          int j) {
    const Start p = start_of(solid, i, j, depth);
    float sum = 0;
    for (const Vec3& l : directions) {
        const float flat = float(std::hypot(l.x, l.y));
        const float du = float(l.x) / flat, dv = -float(l.y) / flat;
        const float dz = float(l.z) / flat / float(solid.width);
        const float to_side = du > 0 ? (float(solid.width) + 0.5f - p.u) / du : (0.5f - p.u) / du;
        const float to_end = dv > 0 ? (float(solid.height) + 0.5f - p.v) / dv : (0.5f - p.v) / dv;
        const int steps = int(std::min(to_side, to_end));
        int inside = 0;
        for (int k = 0; k < steps; ++k)
            inside +=
                p.z + float(k) * dz < bilinear(solid, p.u + float(k) * du, p.v + float(k) * dv);
        const float r = float(inside) * std::hypot(1 / float(solid.width), dz);
        sum += r > float(depth) ? float(depth) / r : 1.0f;
    }
    return sum / float(directions.size());
}

}  // namespace relit::bench
