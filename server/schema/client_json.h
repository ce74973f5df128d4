// JSON as the interface's clients read and write it: answers of a server, what they know of files.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/field/height_field.h"
#include "core/io/decode.h"
#include "server/schema/batch_request.h"

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

/// A line of a manifest: {"name", "scene"}, or a scene, which may have a `name` too.
/// @return its name, empty where it has none, and its scene as JSON, of which nothing is checked
/// @throws Error malformed_json, duplicate_field, invalid_value, unknown_field
[[nodiscard]] BatchFrame read_manifest_line(std::string_view line);

/// {"scenes": [...]}, a batch of what is said here.
/// @param frames  names may be empty
[[nodiscard]] std::string scenes_request(std::span<const BatchFrame> frames);

/// The id of a batch that was accepted. @return nothing when `text` is no such answer
[[nodiscard]] std::optional<std::string> read_batch_id(std::string_view text);

/// How many frames a batch may have, of a server's capabilities. @return nothing when `text` does not
/// say it
[[nodiscard]] std::optional<int> read_max_batch_frames(std::string_view text);

/// A frame that failed on a server.
struct FailedFrame {
    int number = 0;
    ReceivedProblem problem;
};

/// Those of a batch. @return nothing when `text` says nothing of a batch
[[nodiscard]] std::optional<std::vector<FailedFrame>> read_failed_frames(std::string_view text);

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
