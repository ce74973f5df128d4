// Maps much larger than a screen, through the real program: what they take of its memory.
#include <gtest/gtest.h>

#include <fstream>

#include "core/base/sanitized.h"
#include "tests/support/http_client.h"
#include "tests/support/maps.h"
#include "tests/support/processes.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

constexpr int side = 4096;
constexpr long map_mib = 4L * side * side >> 20;  // as floats
constexpr long band_mib = 24;                     // of a picture; does not grow with the map

const std::string& map_file() {
    static const std::string bytes = encoded(
        hills(side, side).heights, {.format = PictureFormat::png, .bit_depth = 16, .srgb = false});
    return bytes;
}

class LargeMap : public testing::Test {
protected:
    void serve(std::vector<std::string> flags) {
        relitd_ = std::make_unique<RelitProcess>(RelitProcess::Settings{.flags = std::move(flags)});
        const HttpReply reply = http(relitd_->port(), "POST", "/v1/images", map_file());
        ASSERT_EQ(reply.status, 201) << reply.body;
        id_ = reply.body.substr(reply.body.find("\"id\":\"") + 6, 64);
    }

    HttpReply render(const std::string& output, const std::string& more = "") {
        return http(relitd_->port(), "POST", "/v1/render",
                    R"({"height": {"image": ")" + id_ + R"("}, "relief": 0.1, "output": )" +
                        output + more + "}");
    }

    // Most that the program took at once while it rendered, beyond what it had before and a band of the
    // picture, in maps.
    double maps_taken_by(const std::string& output, const std::string& more = "") {
        std::ofstream("/proc/" + std::to_string(relitd_->pid()) + "/clear_refs") << 5;  // VmHWM
        const long before = std::stol(status_of(relitd_->pid(), "VmRSS")) / 1024;
        const HttpReply reply = render(output, more);
        EXPECT_EQ(reply.status, 200) << reply.body;
        return double(relitd_->peak_memory_mib() - before - band_mib) / map_mib;
    }

    std::unique_ptr<RelitProcess> relitd_;
    std::string id_;
};

// The map, its rows and its columns for rays to cross, and a band of the picture.
TEST_F(LargeMap, ARenderTakesAtMostFourTimesTheMapWhateverThePictureIs) {
    if (sanitized) GTEST_SKIP() << "the sanitizer's own memory is counted";
    for (const std::string output :
         {R"({"format": "jpeg"})", R"({"format": "png"})", R"({"format": "jpeg", "width": 1024})",
          R"({"format": "jpeg", "region": [1000, 1000, 512, 512]})"}) {
        serve({});
        EXPECT_LT(maps_taken_by(output), 4) << output;
        EXPECT_LT(maps_taken_by(output), 1) << "again, from the cache: " << output;
    }
}

TEST_F(LargeMap, IsRenderedWithACacheThatIsTooSmallForIt) {
    serve({});
    const std::string output = R"({"format": "jpeg", "region": [1000, 1000, 512, 512]})";
    const HttpReply cached = render(output);
    serve({"--max-cache=1MiB"});
    if (!sanitized) {
        EXPECT_LT(maps_taken_by(output), 4);
        EXPECT_LT(maps_taken_by(output), 4) << "again";
    }
    EXPECT_TRUE(render(output).body == cached.body);
}

TEST_F(LargeMap, ThatDoesNotFitIsRefusedBeforeAnythingIsMadeOfIt) {
    serve({"--max-render-memory=200MiB"});
    (void)render(R"({"width": 64, "accuracy": "preview"})");  // the map is in the cache
    std::ofstream("/proc/" + std::to_string(relitd_->pid()) + "/clear_refs") << 5;  // VmHWM
    const long before = std::stol(status_of(relitd_->pid(), "VmRSS")) / 1024;
    const HttpReply reply = render(R"({"format": "jpeg"})");
    EXPECT_EQ(reply.status, 422);
    EXPECT_NE(reply.body.find("the limit is 209715200 (max-render-memory)"), std::string::npos)
        << reply.body;
    EXPECT_NE(reply.body.find(R"("pointer":"/height")"), std::string::npos) << reply.body;
    EXPECT_LT(relitd_->peak_memory_mib(), before + 8);
}

}  // namespace
}  // namespace relit::test
