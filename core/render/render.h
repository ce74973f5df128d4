// Scene -> picture: the whole integrated model, texel by texel. For servers and command lines; from
// Perumal 2017, as written out in the project's specification (integrated model, sections 2 to 9).
#pragma once

#include <functional>
#include <memory>

#include "core/base/parallel.h"
#include "core/base/shared_cache.h"
#include "core/base/simd.h"
#include "core/render/output.h"
#include "core/render/scene.h"
#include "core/visibility/sky_transfer.h"

namespace relit {

/// Part of every ETag: to be raised with each change after which some scene gives another picture.
inline constexpr int picture_revision = 8;

/// How a render runs and reports; nothing in it changes the picture.
struct RenderControl {
    const Executor& executor;
    std::stop_token stop{};
    /// Told the share that is done, rising to 1, from any of the executor's threads, one call at a
    /// time.
    std::function<void(double)> progress{};
    Simd simd = best_simd();  ///< one that is available
    /// Keeps what is made of maps that have a key for the next renders of them; null: it is not kept.
    SharedCache* cache = nullptr;
};

/// What is known of a picture without its pixels.
struct PictureFacts {
    int width = 0;
    int height = 0;
    int channels = 1;  ///< 1 (scalar layer), 3 (RGB) or 4 (RGBA)
    // What was coarser than in the final picture, as Accuracy::preview allows.
    bool coarse_map = false;     ///< shaded on an averaged-down map
    int coarse_environment = 0;  ///< lit from no more directions of an environment; 0: from as many
    bool coarse_transport = false;  ///< light below the surface was summed with larger errors
};

struct Picture : PictureFacts {
    Image pixels;  ///< ready for encode()
};

/// What stands for an environment whose lights are summed one by one (see SkyLight::covers()), in the
/// final picture and in a preview. Against the full sum over 131072 texels the final one is 51 to
/// 73 dB on terrain with the environments of the tests, a preview 39 to 63 dB.
inline constexpr EnvironmentSampling final_environment{.max_texels = 512, .regions = 256};
inline constexpr EnvironmentSampling preview_environment{
    .max_texels = 64, .regions = 64, .parts = 4};

/// Directions that d is projected from for all other environments.
inline constexpr SkyDirections final_sky{.azimuths = 32, .elevations = 12};
inline constexpr SkyDirections preview_sky{.azimuths = 16, .elevations = 8};

/// Renders `output` of `scene`.
///
/// The picture has alpha where the scene has a mask, the layer is not scalar and no background is
/// set. Beauty is sRGB-encoded in [0, 1] with unassociated alpha, or linear, uncut and associated
/// with `output.linear`; with Transfer::none not encoded. The same scene and output give the same
/// numbers for any executor.
///
/// @pre  at least one light; `count` only with lights at a finite distance, `thickness` neither
///       with `count` nor with an environment as first light; the region lies on the map (all
///       asserted: they are checked where scenes come from)
/// @throws Error cancelled
[[nodiscard]] Picture render(const Scene& scene, const Output& output,
                             const RenderControl& control);

/// The same picture some rows at a time, so that nobody needs to hold all of it: what is the same for
/// all rows is prepared once.
class Rendering {
public:
    /// @pre as for render(); what `control` refers to outlives this. @throws Error cancelled
    Rendering(const Scene& scene, const Output& output, const RenderControl& control);
    ~Rendering();
    Rendering(const Rendering&) = delete;
    Rendering& operator=(const Rendering&) = delete;

    [[nodiscard]] const PictureFacts& facts() const;

    /// Those rows of render()'s picture, number by number. From the top down, for the progress that is
    /// told; by one thread at a time. @pre at least one row of the picture. @throws Error cancelled
    [[nodiscard]] Image rows(RowRange rows) const;

private:
    struct Prepared;
    std::unique_ptr<const Prepared> prepared_;
};

}  // namespace relit
