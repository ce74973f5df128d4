#include "core/image/colour.h"

#include <cmath>

// Compiled for wider registers as well, and picked at start: the same operations and numbers. Not under
// sanitizers, which begin after the picking.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define RELIT_CLONED __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define RELIT_CLONED
#endif

namespace relit {

float srgb_to_linear(float encoded) {
    if (encoded <= 0.04045f) return encoded / 12.92f;
    return float(std::pow((double(encoded) + 0.055) / 1.055, 2.4));
}

namespace {

// 1.055 x^(1 / 2.4) - 0.055 as a polynomial of the fourth root of x, lowest power first: interpolated
// at the Chebyshev points of 0.0031308 <= x <= 1, within 6e-7 of it in floats. pow() costs as much as a
// whole march per pixel, C libraries pick variants of it by processor, and tables are not read by
// the register.
constexpr float srgb_curve[] = {-0.0585816801f, 0.125506088f,  1.45024204f,  -1.12084925f,
                                1.14651501f,    -0.833786547f, 0.358946383f, -0.0679922625f};

}  // namespace

RELIT_CLONED void encode_srgb(std::span<float> values) {
    for (float& value : values) {
        const float positive = value > 0 ? value : 0;  // NaN is 0
        const float x = positive < 1 ? positive : 1;
        const float root = std::sqrt(std::sqrt(x));
        float curved = srgb_curve[7];
        for (int n = 6; n >= 0; --n) curved = curved * root + srgb_curve[n];
        const float bright = x < 1 ? curved : 1;
        value = x <= 0.0031308f ? 12.92f * x : bright;
    }
}

float linear_to_srgb(float linear) {
    encode_srgb({&linear, 1});
    return linear;
}

Rgb shading_colour(const Colour& colour, Transfer transfer) {
    const auto number = [&](double v) {
        return colour.hex && transfer == Transfer::srgb ? double(srgb_to_linear(float(v))) : v;
    };
    return {number(colour.values[0]), number(colour.values[1]), number(colour.values[2])};
}

void decode_srgb(Image& image) {
    for (float& value : image.values) value = srgb_to_linear(value);
}

}  // namespace relit
