// The targets without a fuzzer, in every run of the tests and with every compiler and sanitizer: each
// seed, and what chance makes of it, the same chance every time. What fuzzing has found is among the
// seeds.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <vector>

#include "core/base/sanitized.h"
#include "tests/fuzz/targets.h"
#include "tests/support/data.h"

namespace relit::fuzz {
namespace {

namespace fs = std::filesystem;
using Random = std::mt19937;

constexpr std::size_t longest_input = 4096;

std::vector<fs::path> seeds_of(const Target& target) {
    std::vector<fs::path> files;
    const fs::path folder = fs::path(RELIT_SOURCE_DIR) / "tests/fuzz/seeds" / target.name;
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

std::string piece_of(const std::string& text, Random& random) {
    if (text.empty()) return {};
    return text.substr(random() % text.size(), random() % 40);
}

// A number of a text becomes another one, at an end of what fields allow.
void change_number(std::string& input, Random& random) {
    static const char* const numbers[] = {"0",  "-0", "1e-300", "1e-9", "0.999999", "1",
                                          "-1", "10", "1000",   "-999", "10000",    "1e6"};
    const std::size_t begin = input.find_first_of("-0123456789", random() % (input.size() + 1));
    if (begin == std::string::npos) return;
    const std::size_t end = input.find_first_not_of("-+.e0123456789", begin);
    input.replace(begin, std::min(end, input.size()) - begin, numbers[random() % 12]);
}

// One small change, of the kinds that fuzzers make.
void change(std::string& input, const std::string& other, Random& random) {
    const std::size_t at = random() % (input.size() + 1);
    switch (random() % 8) {
        case 0:
            if (at < input.size()) input[at] = char(random());
            break;
        case 1:
            if (at < input.size()) input[at] = char(input[at] ^ 1 << random() % 8);
            break;
        case 2:
            input.erase(at, random() % 16);
            break;
        case 3:
            input.insert(at, piece_of(other, random));
            break;
        case 4:
            input.insert(at, piece_of(input, random));
            break;
        case 5:
            input.insert(at, random() % 2 ? std::string(4, char(0xff)) : "99999999999999999999");
            break;
        default:
            change_number(input, random);
    }
}

class Replay : public testing::TestWithParam<Target> {
protected:
    void SetUp() override {
        for (const fs::path& file : seeds_of(GetParam())) {
            names_.push_back(file.filename());
            seeds_.push_back(test::read_file(file));
        }
        ASSERT_GE(seeds_.size(), 3u);
    }
    // Half a second each; some seconds with a sanitizer.
    [[nodiscard]] int rounds() const {
        const std::string_view name = GetParam().name;
        const int all = name == "http" ? 500 : name == "decode" || name == "render" ? 5000 : 10000;
        return sanitized ? all / 10 : all;
    }
    void run(const std::string& input) const {
        try {
            GetParam().run(input);
        } catch (const std::exception& error) {
            ADD_FAILURE() << error.what() << "\nof the input\n" << testing::PrintToString(input);
        }
    }
    std::vector<std::string> names_;
    std::vector<std::string> seeds_;
};

TEST_P(Replay, EverySeedDoesNoHarm) {
    for (std::size_t i = 0; i < seeds_.size(); ++i) {
        SCOPED_TRACE(names_[i]);
        run(seeds_[i]);
    }
}

TEST_P(Replay, ChangedSeedsDoNoHarm) {
    testing::internal::CaptureStderr();  // decoders' libraries have words for every broken file
    Random random(1);
    for (int round = 0; round < rounds() && !HasFailure(); ++round) {
        std::string input = seeds_[random() % seeds_.size()];
        const std::string& other = seeds_[random() % seeds_.size()];
        for (auto changes = 1 + random() % 4; changes > 0; --changes) change(input, other, random);
        input.resize(std::min(input.size(), longest_input));
        SCOPED_TRACE(testing::Message() << "round " << round);
        run(input);
    }
    (void)testing::internal::GetCapturedStderr();
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Replay, testing::ValuesIn(targets),
                         [](const auto& row) { return std::string(row.param.name); });

}  // namespace
}  // namespace relit::fuzz
