// JSON as the interface's clients read and write it: answers of a server, what they know of files.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/field/height_field.h"
#include "core/io/decode.h"

namespace relit::server {

/// A problem document (RFC 9457) as it was received.
struct ReceivedProblem {
    std::string code;    ///< last part of its type
    std::string detail;  ///< the sentence
    std::string pointer;
};

/// @return nothing when `text` is no problem document
[[nodiscard]] std::optional<ReceivedProblem> read_problem(std::string_view text);

/// JSON over several lines, its fields in their order. @pre `json` is JSON
[[nodiscard]] std::string indented(std::string_view json);

/// What a client knows of an image file of its own.
struct FileInfo {
    std::string file;
    std::string id;
    ImageInfo image;
    std::size_t size_bytes = 0;
    HeightRange heights;          ///< least and greatest finite number, as heights
    std::int64_t not_finite = 0;  ///< texels without a height
    std::int64_t masked = 0;      ///< texels whose alpha is below one half, those left out
};

/// [{"file", "id", "width", "height", "channels", "type", "format", "bytes", "heightRange",
/// "notFinite", "masked"}]
[[nodiscard]] std::string file_info_json(std::span<const FileInfo> files);

}  // namespace relit::server
