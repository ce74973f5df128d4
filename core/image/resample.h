// Images at another size: area average where an axis shrinks, bicubic where it grows. For pictures
// of another size than their map, and for alpha and albedo of another size than the heights.
#pragma once

#include "core/base/parallel.h"
#include "core/base/rect.h"
#include "core/image/image.h"

namespace relit {

/// The part `window` of `source` scaled to width x height texels.
///
/// Per axis: the exact area average when it shrinks (each source texel counts by the share of it
/// that is covered), Catmull-Rom (Keys 1981, a = -1/2) when it grows, a copy when it stays. Bicubic
/// weights reach two texels beyond `window` where `source` goes on there, so that tiles of one map
/// join without a seam, and repeat the border where it ends. Bicubic overshoot is left in; the
/// caller clips where its numbers have a range. Infinite texels give infinity wherever they have a
/// weight; NaN never comes out of finite or infinite input.
///
/// @pre  window lies inside source, sizes >= 1 (asserted)
/// @throws Error cancelled
[[nodiscard]] Image resample(const Image& source, Rect window, int width, int height,
                             const Executor& executor, const std::stop_token& stop = {});

/// Rows of a picture that is made of a source of which not all need be there.
struct ResampledRows {
    RowRange rows;          ///< of the target
    int first_row = 0;      ///< of the source, which `source` begins with
    int source_height = 0;  ///< of the whole source
};

/// Those rows of the same picture, number by number. @pre `source` has the rows that are read for them
/// (asserted). @throws Error cancelled
[[nodiscard]] Image resample(const Image& source, const ResampledRows& part, Rect window, int width,
                             int height, const Executor& executor, const std::stop_token& stop);

/// Rows of a source of that height which those rows of the target are made of.
[[nodiscard]] RowRange resample_reads(RowRange rows, Rect window, int height, int source_height);

/// The whole of `source`.
[[nodiscard]] Image resample(const Image& source, int width, int height, const Executor& executor,
                             const std::stop_token& stop = {});

/// What resample() reads of `map` for `window`: the window and, along axes that grow, the texels
/// around it.
[[nodiscard]] Rect resample_support(Rect window, int width, int height, int map_width,
                                    int map_height);

}  // namespace relit
