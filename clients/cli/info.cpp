// relit info: what an image holds, looked at as a height map.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <iostream>
#include <limits>
#include <span>

#include "clients/cli/commands.h"
#include "clients/cli/failure.h"
#include "clients/cli/input.h"
#include "core/base/error.h"
#include "server/schema/client_json.h"

namespace relit::cli {
namespace {

using server::FileInfo;

bool holds_fractions(SampleType type) {
    return type == SampleType::uint8 || type == SampleType::uint16 || type == SampleType::uint32;
}

void count_masked(const HeightField& field, FileInfo& info) {
    for (int j = 0; j < field.height(); ++j)
        for (int i = 0; i < field.width(); ++i) {
            const std::size_t k = std::size_t(j) * std::size_t(field.width()) + std::size_t(i);
            if (!field.no_height.empty() && field.no_height[k]) ++info.not_finite;
            else if (!field.is_solid(i, j)) ++info.masked;
        }
}

// Of the texels that have a height; the field's numbers are the file's own unless it says otherwise.
HeightRange height_range(const HeightField& field) {
    if (field.rescaled_from) return *field.rescaled_from;
    const Texels& heights = field.heights.values;
    HeightRange range{1, 0};
    for (std::size_t k = 0; k < heights.size(); ++k)
        if (field.no_height.empty() || !field.no_height[k])
            range = {std::min<double>(range.min, heights[k]),
                     std::max<double>(range.max, heights[k])};
    return range;
}

FileInfo info_of(const Input& input) {
    DecodeLimits limits;
    limits.max_pixels = std::numeric_limits<std::int64_t>::max();
    const DecodedImage decoded = decode(input.bytes, limits);
    const HeightField field = height_field_from(decoded.image, decoded.info.has_alpha,
                                                holds_fractions(decoded.info.type));
    FileInfo info{.file = input.name,
                  .id = input.id,
                  .image = decoded.info,
                  .size_bytes = std::string_view(input.bytes).size(),
                  .heights = height_range(field)};
    count_masked(field, info);
    return info;
}

std::string_view channel_words(const ImageInfo& image) {
    constexpr std::string_view words[] = {"grey", "grey and alpha", "RGB", "RGB and alpha"};
    return words[std::clamp(image.channels, 1, 4) - 1];
}

std::string text_of(const FileInfo& info) {
    const ImageInfo& image = info.image;
    std::string text = fmt::format(
        "{}\n  {}, {} x {}, {} of {}, {} bytes\n  id {}\n  heights {} to {}{}\n", info.file,
        name_of(image.format), image.width, image.height, channel_words(image), name_of(image.type),
        info.size_bytes, info.id, float(info.heights.min), float(info.heights.max),
        holds_fractions(image.type) ? fmt::format(" of the largest {}", name_of(image.type)) : "");
    if (info.not_finite > 0) text += fmt::format("  {} texels without a height\n", info.not_finite);
    if (info.masked > 0) text += fmt::format("  {} texels masked by alpha\n", info.masked);
    return text;
}

FileInfo info_of(const std::string& file) {
    const Input input = read_input(file);
    try {
        return info_of(input);
    } catch (const Error& e) {
        throw Failure(Exit::refused, input.name + ": " + part_of_line(e.what()));
    }
}

// One line each, and the first one's exit status.
void report(std::span<const Failure> failures) {
    if (failures.empty()) return;
    for (const Failure& failure : failures) std::cerr << "relit: " << failure.what() << '\n';
    throw Failure(failures.front().status, "");
}

}  // namespace

void info_command(const Options& options, Console console) {
    std::vector<FileInfo> files;
    std::vector<Failure> failures;
    if (std::count(options.files.begin(), options.files.end(), "-") > 1)
        throw Failure(Exit::usage, "stdin (-) can be one input only");
    for (const std::string& file : options.files) {
        console.progress.begin("reading " + file);
        try {
            files.push_back(info_of(file));
        } catch (const Failure& e) {
            failures.push_back(e);
        }
    }
    console.progress.end();
    std::string text;
    for (const FileInfo& info : files) text += text_of(info);
    write_to_stdout(options.json ? server::file_info_json(files) + "\n" : text);
    report(failures);
}

}  // namespace relit::cli
