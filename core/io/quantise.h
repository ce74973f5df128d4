// Floats in [0, 1] -> the integers that picture files store.
#pragma once

#include <concepts>
#include <limits>
#include <vector>

#include "core/image/image.h"

namespace relit {

/// round(value * max) of the type; numbers outside [0, 1] are clipped, NaN is 0.
template <std::unsigned_integral T>
[[nodiscard]] T quantised(float value) noexcept {
    constexpr float max = float(std::numeric_limits<T>::max());
    // NaN fails the first comparison.
    const float clipped = value > 0.0f ? (value < 1.0f ? value : 1.0f) : 0.0f;
    // The largest float below 1/2: what rounds down stays down.
    return T(int(clipped * max + 0.49999997f));
}

template <std::unsigned_integral T>
[[nodiscard]] std::vector<T> quantised(const Image& picture) {
    std::vector<T> values(picture.values.size());
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = quantised<T>(picture.values[i]);
    return values;
}

}  // namespace relit
