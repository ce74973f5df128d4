#include "core/visibility/sky_rays.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/field/normals.h"

namespace relit {
namespace {

using kernels::band_group;
using kernels::band_texels;

constexpr double near_depths = 4;  // the near part reaches so many depths
constexpr double near_growth = 0.25;
constexpr double far_growth = 0.0905;  // 8 steps to the double distance

// The level whose means are as wide as a step.
int level_of(double step) {
    return std::clamp(int(std::floor(std::log2(std::max(1.0, step)))), 0, kernels::max_levels - 1);
}

double diagonal(const Solid& solid) { return std::hypot(solid.width, solid.height); }

int level_count(const Solid& solid) { return level_of(far_growth * 2 * diagonal(solid)) + 1; }

}  // namespace

SkyMarch::SkyMarch(const HeightField& field, const Solid& solid, const SkyRays& rays,
                   SkyDirections directions, const Executor& executor)
    : field_(field),
      solid_(solid),
      rays_(rays),
      depth_(rays.depth * solid.width),
      levels_(solid, depth_, level_count(solid), executor) {
    levels_.describe(scenery_);
    scenery_.has_lower_half = !solid.endless_ground;
    scenery_.floor = float(solid.floor_z * solid.width);
    scenery_.exponential = rays.exponential;
    scenery_.depth = float(depth_);
    scenery_.attenuation = float(rays.attenuation / solid.width);
    choose_samples();
    fill_bands(directions.elevations);
    fill_azimuths(directions.azimuths);
}

void SkyMarch::choose_samples() {
    const double reach = std::max(6.0, near_depths * depth_);
    // Steep rays leave within a part of the depth.
    const double first_step = std::clamp(depth_ / 4, 0.2, 1.0);
    double u = 0;
    int n = 1;
    for (; u < reach && n < kernels::max_near; ++n) {
        const double step = std::max(first_step, near_growth * u);
        u += step;
        scenery_.near[n] = {float(u), float(step), level_of(step)};
    }
    scenery_.near_samples = n - 1;
    const double end = std::max(diagonal(solid_), u);
    const double growth = std::max(far_growth, std::pow(end / u, 1.0 / kernels::max_far) - 1);
    while (u < end && int(far_steps_.size()) < kernels::max_far) {
        far_steps_.push_back(growth * u);
        far_distances_.push_back(u + 0.5 * growth * u);
        u += growth * u;
    }
    scenery_.far_samples = int(far_steps_.size());
    scenery_.far_unit = float(u / 60000);
}

void SkyMarch::fill_bands(int elevations) {
    const std::vector<hemisphere::Node> nodes = hemisphere::nodes(elevations);
    scenery_.bands = elevations;
    for (int b = 0; b < elevations; ++b) {
        const double flat = std::sqrt(1 - nodes[b].z * nodes[b].z);
        scenery_.band[b] = {float(nodes[b].z / flat), float(1 / flat)};
        for (int k = 0; k <= scenery_.near_samples; ++k)
            scenery_.near_rises[b][k] = scenery_.band[b].slope * scenery_.near[k].distance;
    }
}

void SkyMarch::fill_azimuths(int azimuths) {
    constexpr int orders = kernels::max_degree + 1;
    const int bands = scenery_.bands, far = scenery_.far_samples;
    const std::vector<hemisphere::Node> nodes = hemisphere::nodes(bands);
    for (const hemisphere::Radial radial : hemisphere::radials()) {
        kernels::Radial& to = scenery_.radial[scenery_.radials++];
        to.order = radial.order;
        for (int b = 0; b < bands; ++b)
            to.of_band[b] = float(hemisphere::radial_value(radial, nodes[b].z) * nodes[b].weight *
                                  (2 * std::numbers::pi / azimuths));
    }
    far_samples_.resize(std::size_t(azimuths) * far);
    rises_.resize(std::size_t(azimuths) * 2 * bands * far);
    azimuths_.resize(azimuths);
    for (int a = 0; a < azimuths; ++a) {
        const double phi = 2 * std::numbers::pi * (a + 0.5) / azimuths;
        const double x = std::cos(phi), y = std::sin(phi);
        kernels::FarSample* samples = &far_samples_[std::size_t(a) * far];
        short* rises = &rises_[std::size_t(a) * 2 * bands * far];
        azimuths_[a] = {float(x), float(y), samples, rises};
        for (int k = 0; k < far; ++k) {
            const int dx = int(std::lround(far_distances_[k] * x));
            const int dy = int(-std::lround(far_distances_[k] * y));
            samples[k] = {dx, dy, level_of(far_steps_[k]),
                          short(std::lround(far_steps_[k] / scenery_.far_unit))};
            for (int b = 0; b < bands; ++b) {
                const double rise = (dx * x - dy * y) * scenery_.band[b].slope;
                const double height = std::min(rise / (4.0 * scenery_.height_unit), 16000.0);
                rises[b * far + k] = short(std::lround(height));
                rises[(bands + b) * far + k] = short(-std::lround(height));
            }
        }
        for (int m = 0; m < orders; ++m) {
            cosines_.push_back(float(std::cos(m * phi)));
            sines_.push_back(float(std::sin(m * phi)));
        }
    }
    scenery_.azimuths = azimuths;
    scenery_.azimuth = azimuths_.data();
    scenery_.cosines = cosines_.data();
    scenery_.sines = sines_.data();
}

std::optional<kernels::BandPacket> SkyMarch::packet(int i, int j, int end) const {
    kernels::BandPacket packet;
    packet.column = i;
    packet.row = j;
    bool any = false;
    for (int k = 0; k < band_texels; ++k) {
        const int column = std::min(i + k, end - 1);
        any |= field_.is_solid(column, j);
        const Slopes slopes =
            rays_.along_normal ? slopes_at(field_, rays_.relief, column, j) : Slopes{};
        const Vec3 inward = -depth_ * normal_from(slopes);
        packet.right[k] = float(inward.x);
        packet.up[k] = float(inward.y);
        packet.x[k] = float(column + inward.x);
        packet.y[k] = float(j - inward.y);
        packet.z[k] = float(double(solid_.width) * solid_.z.at(column + 1, j + 1) + inward.z);
    }
    if (!any) return {};
    const float reach = scenery_.near[scenery_.near_samples].distance + float(depth_) + 2;
    packet.walled = !levels_.is_whole_near(i, j, reach);
    limit(packet);
    return packet;
}

// Samples beyond which a ray of a group is above all that is round about, or below the floor.
void SkyMarch::limit(kernels::BandPacket& packet) const {
    const auto extremes = std::minmax_element(packet.z, packet.z + band_texels);
    const float low = *extremes.first, high = *extremes.second;
    const float slack = 8 * scenery_.height_unit;
    const float lean = float(depth_);
    const auto last_of = [&](int samples, const auto& counts) {
        while (samples > 0 && !counts(samples - 1)) --samples;
        return samples;
    };
    const auto highest = [&](float distance, int level) {
        return levels_.highest_near(packet.column, packet.row,
                                    distance + lean + float(2 << level) + 2);
    };
    float near_highest[kernels::max_near], far_highest[kernels::max_far];
    for (int k = 0; k < scenery_.near_samples; ++k)
        near_highest[k] = highest(scenery_.near[k + 1].distance, scenery_.near[k + 1].level);
    for (int k = 0; k < scenery_.far_samples; ++k)
        far_highest[k] = highest(float(far_distances_[k]), level_of(far_steps_[k]));
    for (int group = 0; group * band_group < scenery_.bands; ++group) {
        const float slope = scenery_.band[group * band_group].slope;
        const auto rise = [&](double distance) { return slope * (float(distance) - lean); };
        const auto near_distance = [&](int k) { return scenery_.near[k + 1].distance; };
        // A step counts as far as either of its ends does.
        packet.near_samples[0][group] =
            std::min(scenery_.near_samples, 1 + last_of(scenery_.near_samples, [&](int k) {
                                                return near_highest[k] + slack >
                                                       low + slope * near_distance(k);
                                            }));
        packet.far_samples[0][group] = last_of(scenery_.far_samples, [&](int k) {
            return far_highest[k] + slack > low + rise(far_distances_[k]);
        });
        const float above_floor = high - scenery_.floor + slack;
        packet.near_samples[1][group] =
            std::min(scenery_.near_samples, 1 + last_of(scenery_.near_samples, [&](int k) {
                                                return slope * near_distance(k) < above_floor;
                                            }));
        packet.far_samples[1][group] = last_of(
            scenery_.far_samples, [&](int k) { return rise(far_distances_[k] - 1) < above_floor; });
    }
}

}  // namespace relit
