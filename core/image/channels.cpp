#include "core/image/channels.h"

#include "core/image/colour.h"

namespace relit {
namespace {

// `out` texels from `in` texels, each with its own number of channels.
template <class Texel>
Image map_texels(const Image& in, int channels, const Texel& texel) {
    Image out(in.width, in.height, channels);
    const float* from = in.values.data();
    float* to = out.values.data();
    for (std::size_t i = 0; i < in.texels(); ++i, from += in.channels, to += channels)
        texel(from, to);
    return out;
}

int colour_channels(const Image& stored, bool has_alpha) {
    return stored.channels - (has_alpha ? 1 : 0);
}

}  // namespace

Image luminance_channel(Image stored, bool has_alpha) {
    if (stored.channels == 1) return stored;
    if (colour_channels(stored, has_alpha) < 3)
        return map_texels(stored, 1, [](const float* in, float* out) { out[0] = in[0]; });
    return map_texels(stored, 1, [](const float* in, float* out) {
        out[0] = float(luminance({in[0], in[1], in[2]}));
    });
}

Image alpha_channel(const Image& stored) {
    assert(stored.channels == 2 || stored.channels == 4);
    const int last = stored.channels - 1;
    return map_texels(stored, 1, [last](const float* in, float* out) { out[0] = in[last]; });
}

void divide_by_alpha(Image& stored) { divide_by_alpha(stored.values, stored.channels); }

void divide_by_alpha(std::span<float> values, int channels) {
    assert(channels == 2 || channels == 4);
    const int alpha = channels - 1;
    for (std::size_t i = 0; i < values.size(); i += std::size_t(channels)) {
        float* texel = values.data() + i;
        if (!(texel[alpha] > 0)) continue;
        for (int c = 0; c < alpha; ++c) texel[c] /= texel[alpha];
    }
}

Image rgb_channels(const Image& stored, bool has_alpha) {
    const int step = colour_channels(stored, has_alpha) < 3 ? 0 : 1;
    return map_texels(stored, 3, [step](const float* in, float* out) {
        for (int c = 0; c < 3; ++c) out[c] = in[c * step];
    });
}

}  // namespace relit
