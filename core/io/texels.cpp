#include "core/io/texels.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <type_traits>
#include <utility>

#include <Imath/half.h>

#include "core/io/header.h"

namespace relit {
namespace {

std::string letter_of(const std::string& channel) {
    std::string letter = channel.substr(channel.rfind('.') + 1);  // of "layer.R"; npos + 1 is 0
    for (char& c : letter) c = char(std::toupper(static_cast<unsigned char>(c)));
    return letter;
}

template <class T>
constexpr bool is_unsigned_sample = std::is_integral_v<T>&& std::is_unsigned_v<T>;

template <class T>
float to_float(T stored) {
    if constexpr (std::is_same_v<T, std::uint32_t>)
        return float(double(stored) / double(std::numeric_limits<T>::max()));
    else if constexpr (is_unsigned_sample<T>)
        return float(stored) /
               float(std::numeric_limits<T>::max());  // exact operands: the nearest float
    else return float(stored);
}

// The no-data value as the file's own type would hold it; none if it cannot.
template <class T>
std::optional<T> stored_no_data(std::optional<double> value) {
    if (!value) return std::nullopt;
    if constexpr (std::is_integral_v<T>) {
        if (!(*value >= double(std::numeric_limits<T>::min())) ||
            !(*value <= double(std::numeric_limits<T>::max())) || *value != std::trunc(*value))
            return std::nullopt;
        return T(*value);
    } else {
        const T stored = std::is_same_v<T, double> ? T(*value) : T(float(*value));
        if (std::isinf(double(stored)) && !std::isinf(*value)) return std::nullopt;
        return stored;
    }
}

template <class T>
bool same_number(T a, T b) {
    if constexpr (!std::is_integral_v<T>)
        if (std::isnan(double(a)) && std::isnan(double(b))) return true;
    return a == b;
}

template <class T>
void convert_as(const T* stored, std::size_t texels, const Conversion& conversion, float* out) {
    const ChannelMap& map = conversion.map;
    const std::optional<T> no_data = stored_no_data<T>(conversion.no_data);
    const int colours = map.has_alpha ? map.count - 1 : map.count;
    for (std::size_t i = 0; i < texels;
         ++i, stored += conversion.stored_channels, out += map.count) {
        bool masked = no_data.has_value();
        for (int c = 0; c < map.count; ++c) {
            const int from = map.from[std::size_t(c)];
            T value = from < 0 ? T(0) : stored[from];
            if (masked && c < colours) masked = same_number(value, *no_data);
            if constexpr (is_unsigned_sample<T>)
                if (conversion.invert && c < colours)
                    value = T(std::numeric_limits<T>::max() - value);
            out[c] = to_float(value);
        }
        if (masked) std::fill_n(out, map.count, std::numeric_limits<float>::quiet_NaN());
    }
}

}  // namespace

ChannelMap map_named_channels(const std::vector<std::string>& names, FileFormat format) {
    std::vector<std::pair<std::string, int>> colours;
    int alpha = -1;
    for (int c = 0; c < int(names.size()); ++c) {
        std::string letter = letter_of(names[std::size_t(c)]);
        if (letter == "A" && alpha < 0 && names.size() > 1) alpha = c;
        else colours.emplace_back(std::move(letter), c);
    }
    std::sort(colours.begin(), colours.end());
    if (colours.size() > 3) throw_unsupported(format, "four channels none of which is A");
    std::array<int, 3> rgb{-1, -1, -1};
    bool by_name = true;
    for (const auto& [letter, c] : colours) {
        const std::size_t place = letter.size() == 1 ? std::string_view("RGB").find(letter[0]) : 3;
        by_name = by_name && place < 3 && rgb[place] < 0;
        if (by_name) rgb[place] = c;
    }
    if (!by_name)
        for (std::size_t i = 0; i < 3; ++i) rgb[i] = i < colours.size() ? colours[i].second : -1;
    ChannelMap map;
    if (colours.size() == 1) map.push(colours[0].second);
    else
        for (const int c : rgb) map.push(c);
    map.has_alpha = alpha >= 0;
    if (map.has_alpha) map.push(alpha);
    return map;
}

ChannelMap map_ordered_channels(int channels, int alpha) {
    std::vector<int> colours;
    for (int c = 0; c < channels; ++c)
        if (c != alpha) colours.push_back(c);
    if (colours.empty()) colours.push_back(0);
    colours.resize(colours.size() < 3 ? 1 : 3);
    ChannelMap map;
    for (const int c : colours) map.push(c);
    map.has_alpha = alpha >= 0 && channels > 1;
    if (map.has_alpha) map.push(alpha);
    return map;
}

void convert_texels(const std::byte* stored, SampleType type, std::size_t texels,
                    const Conversion& conversion, float* out) {
    const auto as = [&](auto number) {
        convert_as(reinterpret_cast<const decltype(number)*>(stored), texels, conversion, out);
    };
    switch (type) {
        case SampleType::uint8:
            return as(std::uint8_t{});
        case SampleType::uint16:
            return as(std::uint16_t{});
        case SampleType::uint32:
            return as(std::uint32_t{});
        case SampleType::int8:
            return as(std::int8_t{});
        case SampleType::int16:
            return as(std::int16_t{});
        case SampleType::int32:
            return as(std::int32_t{});
        case SampleType::float16:
            return as(half{});
        case SampleType::float32:
            return as(float{});
        case SampleType::float64:
            return as(double{});
    }
}

}  // namespace relit
