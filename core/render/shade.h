// Parts of a map shaded, square by square: the numbers that pictures are made of. For render().
#pragma once

#include <functional>
#include <mutex>

#include "core/base/rect.h"
#include "core/render/fringe.h"
#include "core/render/output.h"
#include "core/render/render.h"
#include "core/render/shader.h"

namespace relit {

/// Counts finished pieces of work and tells the caller, one call at a time and never backwards.
class Progress {
public:
    explicit Progress(const std::function<void(double)>& told) : told_(told) {}

    /// The next so many pieces lead from where the last ones led to the share `until` of all.
    void expect(int pieces, double until);
    /// One of them is done. From any thread.
    void done();

private:
    const std::function<void(double)>& told_;
    double begin_ = 0, end_ = 0;
    int pieces_ = 0, done_ = 0;
    std::mutex mutex_;
};

/// How texels of a map are shaded; all of it must outlive this.
struct PartShading {
    const HeightField& field;
    const Shader& shader;
    const Output& output;
    const NearestSolid* nearest;  ///< null: no texel takes its colour from another
    bool finish;                  ///< beauty is as it is after finish_beauty()
};

/// Channels of what shade() makes of a layer: 1, 3 or 4.
[[nodiscard]] int shaded_channels(Layer layer, const HeightField& field);

/// `part` of the map shaded at its texels: colour in linear light with unassociated alpha, or data. A
/// texel's numbers are the same in any part.
/// @param progress_until  the share of all work that is done with it. @throws Error cancelled
[[nodiscard]] Image shade(const PartShading& how, Rect part, double progress_until,
                          const RenderControl& control, Progress& progress);

}  // namespace relit
