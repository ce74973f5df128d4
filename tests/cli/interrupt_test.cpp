// relit stopped by Ctrl-C and SIGTERM: at once wherever it is, and without half a file. And the
// progress that it shows meanwhile.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <fstream>
#include <thread>

#include "tests/cli/support/cli_process.h"
#include "tests/cli/support/scripted_server.h"
#include "tests/support/encoded.h"
#include "tests/support/temporary_folder.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr double patience_s = 0.2;

// Waves of many sizes, whose render takes seconds.
std::string large_relief(int side) {
    Image map(side, side, 1);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const double u = double(x) / side, v = double(y) / side;
            map.at(x, y) = float(0.5 + 0.2 * std::sin(40 * u + 9 * v) + 0.2 * std::sin(70 * v * u));
        }
    return encoded(map, {.format = PictureFormat::png, .bit_depth = 16, .srgb = false});
}

std::size_t files_in(const std::filesystem::path& folder) {
    const std::filesystem::directory_iterator files(folder);
    return std::size_t(std::distance(begin(files), end(files)));
}

// Seconds from the key or signal to the end.
double seconds_to_stop(OnTerminal& relit, int signal, int status) {
    const auto begin = Clock::now();
    if (signal == SIGINT) relit.type("\x03");
    else relit.signal(signal);
    EXPECT_EQ(relit.exit_status(), status) << relit.screen();
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

TEST(CliInterrupt, StopsALargeRenderAtOnceAndShowsProgressUntilThen) {
    const TemporaryFolder folder, out;
    std::ofstream(folder.path() / "large.png", std::ios::binary) << large_relief(4096);
    const std::string target = out.path() / "a.png";
    const std::vector<std::string> command = {"relit",     "render", "large.png", "--light",
                                              "0.1,1,0.2", "-o",     target};
    {
        OnTerminal relit(command, folder.path());
        std::this_thread::sleep_for(250ms);  // it decodes
        EXPECT_LT(seconds_to_stop(relit, SIGTERM, 143), patience_s);
    }
    OnTerminal relit(command, folder.path());
    ASSERT_TRUE(relit.shows("rendering  ")) << relit.screen();
    ASSERT_TRUE(relit.shows(" % [#")) << relit.screen();
    ASSERT_TRUE(relit.shows(" left")) << relit.screen();
    EXPECT_LT(seconds_to_stop(relit, SIGINT, 130), patience_s);
    EXPECT_TRUE(relit.screen().ends_with("\r\x1b[K")) << "the line of progress is still there";
    EXPECT_EQ(files_in(out.path()), 0u);
}

// The lines of progress that say how far it is.
std::vector<std::string> lines_with_a_share(const std::string& screen) {
    std::vector<std::string> lines;
    const std::string erase = "\r\x1b[K";
    for (auto begin = screen.find(erase); begin != std::string::npos;) {
        begin += erase.size();
        const auto end = screen.find(erase, begin);
        const std::string line = screen.substr(begin, end - begin);
        if (line.find(" % [") != std::string::npos) lines.push_back(line);
        begin = end;
    }
    return lines;
}

TEST(CliInterrupt, SaysHowLongTheRestTakesOnceThatIsKnown) {
    const TemporaryFolder folder;
    std::ofstream(folder.path() / "large.png", std::ios::binary) << large_relief(4096);
    OnTerminal relit(
        {"relit", "render", "large.png", "--light", "0.1,1,0.2", "--threads", "1", "--set",
         "material.illumination=count", "--set", "material.steps=400", "-o", "a.png"},
        folder.path());
    ASSERT_TRUE(relit.shows(" left", 120s)) << relit.screen();
    int early = 0;
    for (const std::string& line : lines_with_a_share(relit.screen())) {
        const double percent = std::stod(line.substr(line.find("rendering") + 9));
        if (percent >= 2) continue;
        ++early;
        EXPECT_EQ(line.find("left"), std::string::npos) << line;
    }
    EXPECT_GT(early, 0) << relit.screen();
}

TEST(CliInterrupt, StopsWhileAServerIsSilent) {
    const TemporaryFolder folder;
    const ScriptedServer silent({});
    OnTerminal relit({"relit", "render", "sample:fish", "-o", "a.png", "--server", silent.url()},
                     folder.path());
    while (silent.requests().empty()) std::this_thread::sleep_for(5ms);
    EXPECT_LT(seconds_to_stop(relit, SIGINT, 130), patience_s);
    EXPECT_EQ(files_in(folder.path()), 0u);
}

// Whenever it is stopped, the picture is there whole or not at all.
TEST(CliInterrupt, LeavesAWholeFileOrNone) {
    const TemporaryFolder folder;
    const std::vector<std::string> command = {"relit", "render", "sample:fish",         "-o",
                                              "a.exr", "--set",  "output.layer=height", "--size",
                                              "1500"};
    ASSERT_EQ(OnTerminal(command, folder.path()).exit_status(), 0);
    const auto whole = std::filesystem::file_size(folder.path() / "a.exr");
    for (int after_ms = 150; after_ms <= 450; after_ms += 50) {
        std::filesystem::remove(folder.path() / "a.exr");
        OnTerminal relit(command, folder.path());
        std::this_thread::sleep_for(std::chrono::milliseconds(after_ms));
        relit.signal(SIGTERM);
        const int status = relit.exit_status();
        if (std::filesystem::exists(folder.path() / "a.exr")) {
            EXPECT_EQ(std::filesystem::file_size(folder.path() / "a.exr"), whole);
            EXPECT_EQ(files_in(folder.path()), 1u);
        } else {
            EXPECT_EQ(status, 143);
            EXPECT_EQ(files_in(folder.path()), 0u);
        }
    }
}

TEST(CliInterrupt, ShowsNoProgressWhereItIsNotWanted) {
    const TemporaryFolder folder;
    const std::string slow =
        "relit render sample:plato -o a.png --size 64 --set material.illumination=count --set "
        "material.steps=800";
    EXPECT_EQ(shell(slow, folder.path()).err, "");
    OnTerminal quiet({"bash", "-c", slow + " --quiet"}, folder.path());
    EXPECT_EQ(quiet.exit_status(), 0);
    EXPECT_EQ(quiet.screen(), "");
    OnTerminal picture({"relit", "render", "sample:plato", "-o", "-"}, folder.path());
    EXPECT_EQ(picture.exit_status(), 2);
    EXPECT_NE(picture.screen().find("stdout is a terminal"), std::string::npos);
}

TEST(CliInterrupt, RespectsThatASignalIsIgnored) {
    const TemporaryFolder folder;
    const Ran ran = shell(
        "trap '' INT; relit render sample:plato -o a.png & pid=$!; sleep 0.15; kill -INT $pid; "
        "wait $pid",
        folder.path());
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(files_in(folder.path()), 1u);
}

}  // namespace
}  // namespace relit::test
