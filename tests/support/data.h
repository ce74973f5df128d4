// The real files that tests look at: scans, terrain, photographs. They are not part of the
// repository; a test that needs one is skipped where they are absent.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace relit::test {

/// RELIT_DATA, or the folder beside the checkout.
inline std::filesystem::path data_folder() {
    const char* from_environment = std::getenv("RELIT_DATA");
    return from_environment
               ? std::filesystem::path(from_environment)
               : std::filesystem::path(RELIT_SOURCE_DIR).parent_path() / "shared" / "data";
}

/// "heights/bunny_512_height.png" -> where it would be.
inline std::filesystem::path data_file(const std::string& name) { return data_folder() / name; }

inline bool has_data(const std::string& name) { return std::filesystem::exists(data_file(name)); }

inline std::string read_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// The bytes of a data file; empty when it is absent.
inline std::string read_data(const std::string& name) { return read_file(data_file(name)); }

}  // namespace relit::test

/// First line of a test that reads `name`.
#define RELIT_SKIP_WITHOUT_DATA(name)                                          \
    if (!relit::test::has_data(name))                                          \
    GTEST_SKIP() << "needs " << (name) << " in " << relit::test::data_folder() \
                 << " (set RELIT_DATA to the folder of test data)"
