#include "core/image/colour.h"

#include <algorithm>
#include <cmath>

namespace relit {

float srgb_to_linear(float encoded) {
    if (encoded <= 0.04045f) return encoded / 12.92f;
    return float(std::pow((double(encoded) + 0.055) / 1.055, 2.4));
}

namespace {

double srgb_formula(double linear) {
    if (linear <= 0.0031308) return 12.92 * linear;
    return 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

// The curve over sqrt(linear), where straight pieces of 1/4096 are within 1e-7 of it. A table,
// because pow costs as much as a whole march per pixel, and because C libraries pick variants of it
// by processor.
constexpr int curve_steps = 4096;
using Curve = std::array<float, curve_steps + 2>;

const Curve& srgb_curve() {
    static const Curve curve = [] {
        Curve c{};
        for (int i = 0; i < int(c.size()); ++i) {
            const double s = double(i) / curve_steps;
            c[i] = float(srgb_formula(s * s));
        }
        return c;
    }();
    return curve;
}

float position_on_curve(float linear) {
    const float positive = linear > 0 ? linear : 0;
    return std::sqrt(positive < 1 ? positive : 1) * curve_steps;
}

float encoded(const Curve& curve, float linear, float position) {
    const int i = int(position);
    const float on_curve = curve[i] + (position - float(i)) * (curve[i + 1] - curve[i]);
    const float kept = linear <= 0.0031308f ? 12.92f * linear : on_curve;
    return linear > 0 ? linear >= 1 ? 1 : kept : 0;
}

}  // namespace

float linear_to_srgb(float linear) {
    return encoded(srgb_curve(), linear, position_on_curve(linear));
}

void encode_srgb(std::span<float> texels, int channels) {
    const Curve& curve = srgb_curve();
    constexpr int run = 1536;
    float positions[run];  // apart: square roots by the register
    for (std::size_t first = 0; first < texels.size(); first += run) {
        const int count = int(std::min<std::size_t>(run, texels.size() - first));
        float* numbers = &texels[first];
        for (int n = 0; n < count; ++n) positions[n] = position_on_curve(numbers[n]);
        for (int n = 0; n < count; n += channels)
            for (int c = n; c < n + 3; ++c) numbers[c] = encoded(curve, numbers[c], positions[c]);
    }
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
