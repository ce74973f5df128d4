// Image files, by the decoder that stands between clients and OpenImageIO.
#include "core/io/decode.h"

#include <algorithm>
#include <cmath>

#include "tests/fuzz/claims.h"
#include "tests/fuzz/targets.h"

namespace relit::fuzz {
namespace {

bool is_fraction(SampleType type) {
    return type == SampleType::uint8 || type == SampleType::uint16 || type == SampleType::uint32;
}

}  // namespace

void decode(std::string_view input) {
    // Small, so that many files a second are read and many reach a limit.
    constexpr DecodeLimits limits{.max_pixels = 1 << 14,
                                  .max_interlaced_pixels = 1 << 13,
                                  .max_values = 1 << 15,
                                  .max_side = 4096};
    DecodedImage decoded;
    const auto read = [&] {
        try {
            decoded = relit::decode(input, limits);
        } catch (const Error& error) {
            for (const char* inside : {"OpenImageIO", "upload", "lib", "std::"})
                claim(std::string_view(error.what()).find(inside) == std::string_view::npos,
                      std::string("a refusal tells nothing of the inside: ") + error.what());
            throw;
        }
    };
    if (!accepts(read)) return;
    const auto& [info, image] = decoded;
    claim(info.width > 0 && info.height > 0 && info.channels > 0, "a picture has texels");
    claim(info.width <= limits.max_side && info.height <= limits.max_side &&
              info.channels <= limits.max_channels &&
              std::int64_t(info.width) * info.height <= limits.max_pixels,
          "a picture keeps its limits");
    claim(image.width == info.width && image.height == info.height &&
              image.channels == info.channels &&
              image.values.size() ==
                  std::size_t(info.width) * std::size_t(info.height) * std::size_t(info.channels),
          "a picture is what is said of it");
    claim(!is_fraction(info.type) || std::all_of(image.values.begin(), image.values.end(),
                                                 [](float value) {
                                                     return std::isnan(value) ||
                                                            (value >= 0 && value <= 1);
                                                 }),
          "unsigned numbers become fractions");
}

}  // namespace relit::fuzz
