// Tables of the elevation-band march, and its packets of starts. For sky_transfer.cpp.
#pragma once

#include <optional>

#include "core/visibility/sky_levels.h"
#include "core/visibility/sky_transfer.h"

namespace relit {

/// Everything that the packets of one map share. Keeps references to field and solid.
class SkyMarch {
public:
    SkyMarch(const HeightField& field, const Solid& solid, const SkyRays& rays,
             SkyDirections directions, const Executor& executor);
    SkyMarch(const SkyMarch&) = delete;
    SkyMarch& operator=(const SkyMarch&) = delete;

    [[nodiscard]] const kernels::BandScenery& scenery() const { return scenery_; }

    /// The texels of row j from column i on, but not those from `end` on; nothing where none of
    /// them is material.
    [[nodiscard]] std::optional<kernels::BandPacket> packet(int i, int j, int end) const;

private:
    void choose_samples();
    void fill_bands(int elevations);
    void fill_azimuths(int azimuths);
    void limit(kernels::BandPacket& packet) const;

    const HeightField& field_;
    const Solid& solid_;
    const SkyRays rays_;
    const double depth_;  // texels
    std::vector<double> far_distances_, far_steps_;
    const SkyLevels levels_;
    kernels::BandScenery scenery_;
    std::vector<kernels::Azimuth> azimuths_;
    std::vector<kernels::FarSample> far_samples_;
    std::vector<short> rises_;
    std::vector<float> cosines_, sines_;
};

}  // namespace relit
