// Radiance HDR (Ward, "Real Pixels"; the RADIANCE manual's picture format): text lines, a blank
// one, the resolution.
#include <charconv>

#include "core/io/header.h"

namespace relit {
namespace {

constexpr std::size_t max_line = 4096;

std::string_view next_line(std::string_view& rest) {
    const std::size_t end = rest.substr(0, max_line).find('\n');
    if (end == std::string_view::npos)
        throw_broken(FileFormat::hdr, "its header does not end or has a line that is too long");
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end + 1);
    return line;
}

std::int64_t take_number(std::string_view& text, std::string_view prefix) {
    std::int32_t number = 0;
    if (!text.starts_with(prefix))
        throw_unsupported(FileFormat::hdr, "another order of rows than -Y +X");
    text.remove_prefix(prefix.size());
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || number < 0)
        throw_broken(FileFormat::hdr, "its size is not a number");
    text.remove_prefix(std::size_t(end - text.data()));
    return number;
}

}  // namespace

FileHeader read_hdr_header(std::string_view bytes) {
    std::string_view rest = bytes;
    for (std::string_view line = next_line(rest); !line.empty(); line = next_line(rest))
        if (line.starts_with("FORMAT=") && !line.starts_with("FORMAT=32-bit_rle_rgbe"))
            throw_unsupported(FileFormat::hdr, "another encoding than RGBE");
    std::string_view resolution = next_line(rest);
    FileHeader header;
    header.height = take_number(resolution, "-Y ");
    header.width = take_number(resolution, " +X ");
    header.channels = 3;
    // Every row has at least one run of four bytes.
    header.least_bytes = capped_product({header.height, 4});
    return header;
}

}  // namespace relit
