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

// Calls `change` with the colours of each row, alpha left out.
template <class Change>
void change_colours(Image& image, const Executor& executor, const std::stop_token& stop,
                    const Change& change) {
    parallel_rows(executor, image.height, stop, [&](RowRange rows) {
        std::vector<float> colours;
        for (int y = rows.begin; y < rows.end; ++y) {
            const std::span<float> row = image.row(y);
            if (image.channels == 3) {
                change(row);
                continue;
            }
            colours.resize(std::size_t(image.width) * 3);
            for (std::size_t x = 0; x < std::size_t(image.width); ++x)
                std::copy_n(&row[4 * x], 3, &colours[3 * x]);
            change(std::span<float>(colours));
            for (std::size_t x = 0; x < std::size_t(image.width); ++x)
                std::copy_n(&colours[3 * x], 3, &row[4 * x]);
        }
    });
}

void expose(std::span<float> colours, const Output& output) {
    const float gain = float(std::exp2(output.exposure));
    if (output.tone == Tone::filmic)
        for (float& v : colours) v = filmic(gain * v);
    else if (gain != 1)
        for (float& v : colours) v *= gain;
}

bool is_encoded(const Output& output) {
    return !output.linear && output.transfer == Transfer::srgb;
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

bool is_finished_by_colours(const Output& output, bool has_alpha) {
    return !has_alpha || !(output.background || output.linear);
}

void finish_colours(std::span<float> colours, const Output& output) {
    expose(colours, output);
    if (is_encoded(output)) encode_srgb(colours);
}

void finish_beauty(Image& image, const Output& output, const Executor& executor,
                   const std::stop_token& stop) {
    const auto change = [&](const auto& how) { change_colours(image, executor, stop, how); };
    if (is_finished_by_colours(output, image.channels == 4))
        return change([&](std::span<float> row) { finish_colours(row, output); });
    change([&](std::span<float> row) { expose(row, output); });
    if (output.background) image = over(image, shading_colour(*output.background, output.transfer));
    if (output.linear) associate_alpha(image);
    if (is_encoded(output)) change([](std::span<float> row) { encode_srgb(row); });
}

void finish_data(Image& image, const Output& output) {
    if (output.background && image.channels == 4)
        image = over(image, shading_colour(*output.background, Transfer::none));
}

}  // namespace relit
