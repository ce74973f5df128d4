// relit sweep --animation, relit batch --animation: the frames once more, as one file.
#include <gtest/gtest.h>

#include "core/io/decode.h"
#include "core/io/quantise.h"
#include "tests/cli/support/cli_folder.h"
#include "tests/support/relit_process.h"
#include "tests/support/shown_frames.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

namespace fs = std::filesystem;

class CliAnimation : public CliFolder {
protected:
    // An RGB file as an animation shows it.
    [[nodiscard]] std::vector<std::uint8_t> rgba_of(const std::string& name) const {
        const Image image = decode(read(name)).image;
        EXPECT_EQ(image.channels, 3) << name;
        std::vector<std::uint8_t> rgba;
        for (const float value : image.values) {
            rgba.push_back(quantised<std::uint8_t>(value));
            if (rgba.size() % 4 == 3) rgba.push_back(255);
        }
        return rgba;
    }
};

const std::string orbit = "relit sweep sample:st-helens --orbit 6 --size 40 -o f ";

TEST_F(CliAnimation, ShowsTheFramesInTheirOrderAndLeavesThemInTheFolder) {
    const Ran ran = run(orbit + "--animation orbit.webp --animation-quality lossless");
    ASSERT_EQ(ran.status, 0) << ran.err;
    const ShownAnimation animation = shown(read("orbit.webp"));
    EXPECT_EQ(animation.loops, 0);
    ASSERT_EQ(animation.frames.size(), 6u);
    for (int i = 0; i < 6; ++i) {
        EXPECT_EQ(animation.frames[i].rgba, rgba_of("f/000" + std::to_string(i) + ".png"));
        EXPECT_EQ(animation.frames[i].end_ms, 40 * (i + 1));
    }
}

TEST_F(CliAnimation, OfAManifestIsInItsOrderWhateverTheNamesAndFormats) {
    const std::string scene = R"({"height": {"image": "st-helens"}, "output": {"width": 24, )";
    const std::string manifest = R"({"name": "z.png", "scene": )" + scene + R"("bitDepth": 16}}})" +
                                 "\n" + R"({"name": "b.jpg", "scene": )" + scene +
                                 R"("exposure": 1}}})" + "\n" + R"({"name": "a.webp", "scene": )" +
                                 scene + R"("exposure": -1}}})" + "\n";
    const Ran ran = run("relit batch - -o f --animation f/all.webp --fps 10", manifest);
    ASSERT_EQ(ran.status, 0) << ran.err;
    const ShownAnimation animation = shown(read("f/all.webp"));
    ASSERT_EQ(animation.frames.size(), 3u);
    EXPECT_EQ(animation.frames[2].end_ms, 300);
    const char* const names[] = {"f/z.png", "f/b.jpg", "f/a.webp"};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto expected = rgba_of(names[i]);
        double sum = 0;
        for (std::size_t k = 0; k < expected.size(); ++k)
            sum += std::abs(expected[k] - animation.frames[i].rgba[k]);
        EXPECT_LT(sum / double(expected.size()), 6) << names[i];
    }
}

TEST_F(CliAnimation, IsTheSameFileHereThereAndResumed) {
    const RelitProcess relitd;
    ASSERT_EQ(run(orbit + "--animation here.webp").status, 0);
    const Ran again = run(orbit + "--animation AGAIN.WEBP");
    EXPECT_EQ(again.status, 0);
    EXPECT_EQ(again.err, "relit: 6 of 6 frames are there already\n");
    fs::remove(folder.path() / "f/0002.png");
    EXPECT_EQ(run(orbit + "--animation - > resumed.webp").status, 0);
    fs::remove_all(folder.path() / "f");
    const Ran there = run(orbit + "--animation there.webp --server http://127.0.0.1:" +
                          std::to_string(relitd.port()));
    EXPECT_EQ(there.status, 0) << there.err;
    const std::string here = read("here.webp");
    EXPECT_EQ(shown(here).frames.size(), 6u);
    for (const char* name : {"AGAIN.WEBP", "resumed.webp", "there.webp"})
        EXPECT_TRUE(read(name) == here) << name;
}

TEST_F(CliAnimation, IsMadeOfShardsOnceTheyAreDone) {
    for (const char* shard : {"0/2", "1/2"}) ASSERT_EQ(run(orbit + "--shard " + shard).status, 0);
    expect_refusal(
        orbit + "--shard 0/2 --animation a.webp", 2,
        "--animation takes all frames: give it without --shard over the same folder when "
        "the shards are done");
    EXPECT_EQ(run(orbit + "--animation a.webp").err, "relit: 6 of 6 frames are there already\n");
    EXPECT_EQ(shown(read("a.webp")).frames.size(), 6u);
}

TEST_F(CliAnimation, IsNotMadeWithoutTheFramesThatFailed) {
    write("map.png", small_png());
    write("broken.png", small_png().substr(0, 60));
    const std::string manifest = R"({"name": "a.png", "scene": {"height": {"part": "map.png"}}}
{"name": "b.png", "scene": {"height": {"part": "broken.png"}}}
)";
    write("m.jsonl", manifest);
    write("a.webp", "what was there");
    const Ran ran = run("relit batch m.jsonl -o f --animation a.webp");
    EXPECT_EQ(ran.status, 1);
    EXPECT_NE(ran.err.find("relit: b.png: broken.png: "), std::string::npos) << ran.err;
    EXPECT_TRUE(
        ran.err.ends_with("relit: 1 of 2 frames failed; there is no animation without them\n"))
        << ran.err;
    EXPECT_EQ(read("a.webp"), "what was there");
}

TEST_F(CliAnimation, RefusesWhatCannotBe) {
    const std::string sweep = "relit sweep sample:plato --orbit 2 --size 8 -o f ";
    expect_refusal(sweep + "--animation a.gif", 2,
                   "--animation: a.gif does not end in .webp, which is what an animation is "
                   "written as");
    expect_refusal(sweep + "--fps 10", 2, "--fps requires --animation; see relit sweep --help");
    for (const std::string bad : {"0.9", "91", "nan", "25x"})
        expect_refusal(sweep + "--animation a.webp --fps " + bad, 2,
                       "--fps: '" + bad + "' is not a number from 1 to 90");
    for (const std::string bad : {"0", "101", "best", "85%"})
        expect_refusal(sweep + "--animation a.webp --animation-quality " + bad, 2,
                       "--animation-quality: '" + bad + "' is not 1 to 100 or lossless");
    EXPECT_FALSE(fs::exists(folder.path() / "f")) << "nothing of it begins";
    expect_refusal(sweep + "--animation nowhere/a.webp", 3,
                   "nowhere/a.webp: cannot write it: no such file or directory");
    expect_refusal(sweep + "--animation a.webp --format exr", 2,
                   "0000.exr: is OpenEXR, which holds linear light; --animation takes png, jpeg "
                   "and webp");
    expect_refusal(sweep + "--animation f/../f/0001.webp --format webp", 2,
                   "f/../f/0001.webp: is a frame too; give the animation another name");
    EXPECT_FALSE(fs::exists(folder.path() / "f/0000.webp")) << "no frame is made";
    const std::string line = R"({"height": {"image": "plato"}, "output": {"width": )";
    expect_refusal("relit batch - -o f --animation a.webp", 1,
                   "f/0001.png: it is 16 x 16, the frames before it are 8 x 8",
                   line + "8}}\n" + line + "16}}\n");
    EXPECT_FALSE(fs::exists(folder.path() / "a.webp"));
}

}  // namespace
}  // namespace relit::test
