// Channels picked out of a decoded image: what a height map, a mask or a colour image means by its
// 1 to 4 channels.
#pragma once

#include <span>

#include "core/image/image.h"

namespace relit {

/// One channel: the grey channel, or the Rec. 709 luminance of the stored colour numbers. Alpha is
/// left out.
/// @param has_alpha  the last of 2 or 4 channels is alpha
[[nodiscard]] Image luminance_channel(Image stored, bool has_alpha);

/// The alpha channel. @pre has alpha, that is 2 or 4 channels (asserted)
[[nodiscard]] Image alpha_channel(const Image& stored);

/// Colour that was stored multiplied by alpha, divided by it, in place. Texels of alpha 0 stay: they
/// emit. @pre has alpha (asserted)
void divide_by_alpha(Image& stored);

/// The same of the numbers of an image of 2 or 4 channels.
void divide_by_alpha(std::span<float> values, int channels);

/// Three channels: colour, or grey three times. Alpha is left out.
[[nodiscard]] Image rgb_channels(const Image& stored, bool has_alpha);

}  // namespace relit
