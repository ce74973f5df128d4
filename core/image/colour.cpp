#include "core/image/colour.h"

#include <algorithm>
#include <array>
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

}  // namespace

void encode_srgb(std::span<float> values) {
    const Curve& curve = srgb_curve();
    std::array<float, 256> positions;  // apart, so that square roots are taken by the register
    for (; !values.empty(); values = values.subspan(std::min(positions.size(), values.size()))) {
        const std::size_t size = std::min(positions.size(), values.size());
        for (std::size_t k = 0; k < size; ++k) {
            const float positive = values[k] > 0 ? values[k] : 0;  // NaN is 0
            values[k] = positive < 1 ? positive : 1;
        }
        for (std::size_t k = 0; k < size; ++k) positions[k] = std::sqrt(values[k]) * curve_steps;
        for (std::size_t k = 0; k < size; ++k) {
            const int i = int(positions[k]);
            const float curved = curve[i] + (positions[k] - float(i)) * (curve[i + 1] - curve[i]);
            values[k] = values[k] <= 0.0031308f ? 12.92f * values[k] : curved;
        }
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
