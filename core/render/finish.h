// From shaded numbers to the numbers of a file: exposure, tone, background, sRGB, alpha. The last
// step of render(). Source: integrated model, sections 5 and 7.
#pragma once

#include "core/base/parallel.h"
#include "core/render/output.h"

namespace relit {

/// Multiplies the colour of an RGBA image by its alpha, so that it may be resampled. RGB is left
/// alone.
void associate_alpha(Image& image);

/// Divides it out again; colour is 0 where alpha is.
void unassociate_alpha(Image& image);

/// Whether a finished beauty picture needs nothing but its colours finished, number by number.
[[nodiscard]] bool is_finished_by_colours(const Output& output, bool has_alpha);

/// Exposure, tone and sRGB of numbers of a beauty picture of that kind, in place.
void finish_colours(std::span<float> colours, const Output& output);

/// Finishes a beauty picture in place: linear light, 3 or 4 channels, alpha unassociated.
/// Exposure and tone first, then the background is laid under it (and alpha goes), then sRGB, or
/// for a linear file alpha is associated. @throws Error cancelled
void finish_beauty(Image& image, const Output& output, const Executor& executor,
                   const std::stop_token& stop);

/// Finishes a data layer in place: numbers stay as they are; a background is laid under a normal
/// layer.
void finish_data(Image& image, const Output& output);

/// Narkowicz 2016; x >= 0 in linear light. @return in [0, 1.04): it passes 1 far above white
[[nodiscard]] float filmic(float x);

}  // namespace relit
