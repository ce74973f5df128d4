// Files that go in: by path, from stdin, or a sample that ships.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "server/shared_bytes.h"

namespace relit::cli {

struct Input {
    std::string name;            ///< as errors call it: "relief.png", "stdin", "sample:plato"
    std::filesystem::path path;  ///< empty unless it is a file
    server::SharedBytes bytes;   ///< at least one
    std::string id;              ///< SHA-256 of the bytes
};

/// Reads what a command line names: a path, "-" for stdin, "sample:NAME" (or its id).
/// @throws Failure unreachable (no such file, a folder, not readable), refused (empty, no such
///         sample)
[[nodiscard]] Input read_input(const std::string& argument);

/// Reads a file, whatever it is called. @throws Failure as read_input()
[[nodiscard]] Input read_file(const std::filesystem::path& path);

}  // namespace relit::cli
