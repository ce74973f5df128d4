#include "core/render/finish.h"

#include <algorithm>
#include <cmath>

namespace relit {
namespace {

// The picture over `colour`, without alpha.
Image over(const Image& picture, Rgb colour) {
    const float under[3] = {float(colour.r), float(colour.g), float(colour.b)};
    Image result(picture.width, picture.height, 3);
    const float* in = picture.values.data();
    float* out = result.values.data();
    for (std::size_t n = 0; n < picture.texels(); ++n, in += 4, out += 3)
        for (int c = 0; c < 3; ++c) out[c] = in[c] * in[3] + under[c] * (1 - in[3]);
    return result;
}

template <class Value>
void map_colour_rows(Image& image, const Executor& executor, const std::stop_token& stop,
                     const Value& value) {
    const int colours = 3;
    parallel_rows(executor, image.height, stop, [&](RowRange rows) {
        for (int y = rows.begin; y < rows.end; ++y) {
            float* texel = image.row(y).data();
            for (int x = 0; x < image.width; ++x, texel += image.channels)
                for (int c = 0; c < colours; ++c) texel[c] = value(texel[c]);
        }
    });
}

}  // namespace

float filmic(float x) {
    x = std::min(x, 1e6f);  // where its square is far from overflowing and the curve long flat
    return x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f);
}

void associate_alpha(Image& image) {
    if (image.channels != 4) return;
    for (std::size_t n = 0; n < image.values.size(); n += 4)
        for (int c = 0; c < 3; ++c) image.values[n + c] *= image.values[n + 3];
}

void unassociate_alpha(Image& image) {
    if (image.channels != 4) return;
    for (std::size_t n = 0; n < image.values.size(); n += 4) {
        const float alpha = image.values[n + 3];
        for (int c = 0; c < 3; ++c)
            image.values[n + c] = alpha > 0 ? image.values[n + c] / alpha : 0;
    }
}

void finish_beauty(Image& image, const Output& output, const Executor& executor,
                   const std::stop_token& stop) {
    const float gain = float(std::exp2(output.exposure));
    const bool toned = output.tone == Tone::filmic;
    if (gain != 1 || toned)
        map_colour_rows(image, executor, stop,
                        [&](float v) { return toned ? filmic(gain * v) : gain * v; });
    if (output.background && image.channels == 4)
        image = over(image, shading_colour(*output.background, output.transfer));
    if (output.linear) associate_alpha(image);
    else if (output.transfer == Transfer::srgb)
        parallel_rows(executor, image.height, stop, [&](RowRange rows) {
            for (int y = rows.begin; y < rows.end; ++y) encode_srgb(image.row(y), image.channels);
        });
}

void finish_data(Image& image, const Output& output) {
    if (output.background && image.channels == 4)
        image = over(image, shading_colour(*output.background, Transfer::none));
}

}  // namespace relit
