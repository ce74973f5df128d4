// relit render and relit scene on this machine: inputs, formats, precedence, refusals.
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <algorithm>

#include "core/io/decode.h"
#include "tests/cli/support/cli_folder.h"
#include "tests/support/base64.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

class Cli : public CliFolder {
protected:
    // Names in the folder, sorted.
    [[nodiscard]] std::vector<std::string> names() const {
        std::vector<std::string> list;
        for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
            list.push_back(entry.path().filename().string());
        std::sort(list.begin(), list.end());
        return list;
    }
};

using CliRender = Cli;
using CliScene = Cli;

const std::filesystem::path samples = std::filesystem::path(RELIT_SOURCE_DIR) / "server/samples";

TEST_F(CliRender, MakesAPictureOfASampleWithAPresetAndALight) {
    const Ran ran = run("relit render sample:plato -o out.png --preset bronze --light 0.3,0.8,0.4");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(ran.out + ran.err, "");
    const ImageInfo info = decode(read("out.png")).info;
    EXPECT_EQ(info.format, FileFormat::png);
    EXPECT_EQ(info.width, 512);
    EXPECT_EQ(names(), std::vector<std::string>{"out.png"});
    struct stat status {};
    ASSERT_EQ(::stat((folder.path() / "out.png").c_str(), &status), 0);
    const mode_t mask = ::umask(0);
    ::umask(mask);
    EXPECT_EQ(status.st_mode & 0777u, 0666u & ~mask);
}

TEST_F(CliRender, TurnsA16BitPngFromAPipeIntoAJpegInAPipe) {
    const Ran ran = run("cat | relit render - -o - --format jpeg --size 100 | cat",
                        read_file(samples / "plato.png"));
    ASSERT_EQ(ran.status, 0) << ran.err;
    const ImageInfo info = decode(ran.out).info;
    EXPECT_EQ(info.format, FileFormat::jpeg);
    EXPECT_EQ(info.width, 100);
}

TEST_F(CliRender, RendersAnElevationModelOfFloats) {
    const std::string dem = (samples / "st-helens.tif").string();
    const Ran ran = run("relit render '" + dem + "' -o dem.webp --sun 315,20 --set relief=0.2");
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(decode(read("dem.webp")).info.width, 317);
}

TEST_F(CliRender, TakesTheFormatFromTheName) {
    write("map.png", small_png());
    const std::pair<const char*, FileFormat> names_and_formats[] = {{"a.JPG", FileFormat::jpeg},
                                                                    {"a.webp", FileFormat::webp},
                                                                    {"a.exr", FileFormat::exr},
                                                                    {"a", FileFormat::png}};
    for (const auto& [name, format] : names_and_formats) {
        const Ran ran = run(std::string("relit render map.png -o ") + name);
        EXPECT_EQ(ran.status, 0) << ran.err;
        EXPECT_EQ(decode(read(name)).info.format, format) << name;
    }
    write("jpeg.json", R"({"output": {"format": "jpeg"}})");
    EXPECT_EQ(run("relit render map.png -o b --scene jpeg.json").status, 0);
    EXPECT_EQ(decode(read("b")).info.format, FileFormat::jpeg);
    EXPECT_EQ(run("relit render map.png -o b.png --scene jpeg.json --format png").status, 0);
    EXPECT_EQ(decode(read("b.png")).info.format, FileFormat::png);
}

TEST_F(CliRender, RefusesFormatsThatContradictEachOther) {
    write("map.png", small_png());
    const std::string settles = "; --format png or another name settles it";
    const std::string words = "a.png: the name says png, output.format says jpeg" + settles;
    write("jpeg.json", R"({"output": {"format": "jpeg"}})");
    expect_refusal("relit render map.png -o a.png --scene jpeg.json", 2, words);
    expect_refusal("relit render map.png -o a.png --set output.format=jpeg", 2, words);
    expect_refusal("relit render map.png -o a.bmp", 2,
                   "a.bmp: '.bmp' is no picture's ending; there are .png, .jpg, .webp and .exr, or "
                   "say --format");
}

TEST_F(CliRender, SetBeatsFlagsBeatSceneBeatsPreset) {
    write("map.png", small_png());
    write("scene.json", R"({"relief": 0.3, "light": {"type": "point",
        "position": [0.5, 0.5, 1], "intensity": 3}, "output": {"width": 10, "height": 10}})");
    const auto scene = [&](const std::string& flags) {
        const Ran ran = run("relit scene map.png " + flags + " | tr -d ' \\n'");
        EXPECT_EQ(ran.status, 0) << ran.err;
        return ran.out;
    };
    const auto has = [](const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos ? testing::AssertionSuccess()
                                                    : testing::AssertionFailure() << text;
    };
    const std::string preset = scene("--preset bronze");
    EXPECT_TRUE(has(preset, R"("diffuseColor":"#8a5a2b")"));
    EXPECT_TRUE(has(preset, R"("relief":0.12)"));
    const std::string file = scene("--preset bronze --scene scene.json");
    EXPECT_TRUE(has(file, R"("diffuseColor":"#8a5a2b")"));
    EXPECT_TRUE(has(file, R"("relief":0.3)"));
    EXPECT_TRUE(has(file, R"("width":10,"height":10)"));
    const std::string flags = scene("--scene scene.json --light 0,0,2 --size x5");
    EXPECT_TRUE(has(flags, R"("position":[0,0,2])"));
    EXPECT_TRUE(has(flags, R"("intensity":3)"));
    EXPECT_TRUE(has(flags, R"("width":null,"height":5)"));
    const std::string set = scene(
        "--scene scene.json --light 0,0,2 --set light.position=1,1,1 --set relief=0.4 --set "
        "material.specular.occlude=true");
    EXPECT_TRUE(has(set, R"("position":[1,1,1])"));
    EXPECT_TRUE(has(set, R"("relief":0.4)"));
    EXPECT_TRUE(has(set, R"("occlude":true)"));
}

TEST_F(CliRender, RefusesAPresetBesideThatOfTheSceneFile) {
    write("map.png", small_png());
    write("wax.json", R"({"preset": "wax", "relief": 0.3})");
    const std::string words =
        " names a preset itself, which is stronger; --set preset=gold replaces it";
    const std::string rest = "relit render map.png -o a.png --preset gold --scene ";
    expect_refusal(rest + "wax.json", 2, "--preset: wax.json" + words);
    expect_refusal(rest + "- < wax.json", 2, "--preset: stdin" + words);
    write("gold.json", R"({"preset": "gold", "relief": 0.3})");
    const std::string gold = run("relit scene map.png --scene gold.json --etag").out;
    EXPECT_EQ(run("relit scene map.png --scene wax.json --set preset=gold --etag").out, gold);
    EXPECT_NE(run("relit scene map.png --scene wax.json --etag").out, gold);
    EXPECT_NE(gold, "");
}

TEST_F(CliRender, OverwritesNoInput) {
    const std::string scene = R"({"relief": 0.3})";
    write("map.png", small_png());
    write("same.png", small_png());
    write("s", scene);
    const std::string words = " is an input too; give the picture another name";
    expect_refusal("relit render map.png -o ./map.png", 2, "./map.png:" + words);
    expect_refusal("relit render map.png --scene s -o s", 2, "s:" + words);
    expect_refusal("relit render map.png --alpha same.png -o same.png", 2, "same.png:" + words);
    expect_refusal("ln map.png hard; relit render map.png -o hard", 2, "hard:" + words);
    EXPECT_EQ(read("s"), scene);
    EXPECT_EQ(read("same.png"), small_png());
    EXPECT_EQ(read("map.png"), small_png());
}

TEST_F(CliRender, FindsTheImagesOfASceneFileWhereverTheyAre) {
    std::filesystem::create_directory(folder.path() / "sub");
    write("sub/map.png", small_png());
    write("sub/mask.png", small_png(5));
    const std::string rest =
        R"(, "light": {"type": "environment", "image": {"image": "rainbow"}}})";
    write("sub/part.json",
          R"({"height": {"part": "map.png"}, "alpha": {"part": "mask.png"})" + rest);
    write("data.json", R"({"height": {"data": ")" + encode_base64(small_png()) +
                           R"("}, "alpha": {"data": ")" + encode_base64(small_png(5)) + "\"}" +
                           rest);
    ASSERT_EQ(run("relit render --scene sub/part.json -o part.png").status, 0);
    ASSERT_EQ(run("relit render --scene - -o data.png < data.json").status, 0);
    const Ran flags =
        run("relit render sub/map.png --alpha sub/mask.png --env sample:rainbow -o flags.png");
    ASSERT_EQ(flags.status, 0) << flags.err;
    EXPECT_FALSE(read("flags.png").empty());
    EXPECT_EQ(read("part.png"), read("flags.png"));
    EXPECT_EQ(read("data.png"), read("flags.png"));
    EXPECT_EQ(run("relit render sub/map.png --scene sub/part.json -o same.png").status, 0);
    EXPECT_EQ(read("same.png"), read("part.png"));
}

TEST_F(CliRender, TakesEnvironmentsWithAnglesAndCommasInTheirNames) {
    write("map.png", small_png());
    write("a,1.png", small_png(2, 32, 16));
    const auto rotation = [&](const std::string& env) {
        const Ran ran = run("relit scene map.png --env " + env + " | tr -d ' \\n'");
        EXPECT_EQ(ran.status, 0) << ran.err;
        const auto begin = ran.out.find("\"rotation\":");
        return ran.out.substr(begin + 11, ran.out.find(']', begin) - begin - 10);
    };
    EXPECT_EQ(rotation("sample:venice-sunset"), "[0,0]");
    EXPECT_EQ(rotation("sample:venice-sunset,30"), "[30,0]");
    EXPECT_EQ(rotation("sample:venice-sunset,30,-5.5"), "[30,-5.5]");
    EXPECT_EQ(rotation("a,1.png,7"), "[7,0]");
}

TEST_F(CliRender, RefusesWhatItCannotReadOrWriteAndLeavesNothingBehind) {
    write("map.png", small_png());
    write("empty.png", "");
    write("cut.png", small_png().substr(0, 60));
    std::filesystem::create_directory(folder.path() / "sub");
    const auto before = names();
    expect_refusal("relit render none.png -o a.png", 3,
                   "none.png: cannot read it: no such file or directory");
    expect_refusal("relit render sub -o a.png", 3, "sub: is a folder");
    expect_refusal("relit render empty.png -o a.png", 1, "empty.png: is empty");
    expect_refusal("relit render cut.png -o a.png", 1,
                   "cut.png: the PNG file is broken: it ends too early");
    expect_refusal("relit render map.png -o nowhere/a.png", 3,
                   "nowhere/a.png: cannot write it: no such file or directory");
    expect_refusal("relit render map.png -o /dev/full", 3,
                   "/dev/full: cannot write it: no space left on device");
    expect_refusal("relit render sample:nobody -o a.png", 1,
                   "sample:nobody: there is no such sample; there are plato, head, fish, "
                   "st-helens, venice-sunset, rainbow");
    expect_refusal("ulimit -f 1; relit render map.png -o a.exr --size 200", 3,
                   "a.exr: cannot write it: file too large");
    EXPECT_EQ(names(), before);
    EXPECT_EQ(read("map.png"), small_png());
}

TEST_F(CliRender, RefusesValuesNamingTheirField) {
    write("map.png", small_png());
    expect_refusal("relit render map.png -o a.png --set material.depth=0", 1,
                   "'material.depth' must be a number above 0 and at most 10");
    expect_refusal("relit render map.png -o a.png --light 1,2", 1,
                   "'light.position' must be [x, y, z]: 3 numbers");
    expect_refusal("relit render map.png -o a.png --set output.region=[0,0,99,1]", 1,
                   "'output.region' reaches beyond the map of 16 x 12 texels");
    expect_refusal("relit render map.png -o a.png --set albedo.image=abc", 1,
                   "'albedo.image' is stored on a server: give --server");
    write("twice.json", R"({"relief": 1, "relief": 2})");
    expect_refusal("relit render map.png -o a.png --scene twice.json", 1,
                   "twice.json: 'relief' is there twice");
}

TEST_F(CliRender, SaysWhatOfTheCommandLineItDoesNotUnderstand) {
    write("map.png", small_png());
    expect_refusal("relit", 2, "a subcommand is required; see relit --help");
    expect_refusal("relit frob", 2, "there is no command 'frob'; see relit --help");
    expect_refusal("relit render map.png", 2, "--output is required; see relit render --help");
    expect_refusal("relit render -o a.png", 2,
                   "there is no relief: name a file, - or sample:plato");
    expect_refusal("relit render map.png -o a.png --light 1,2,3 --sun 1,2", 2,
                   "--light excludes --sun; see relit render --help");
    expect_refusal("relit render map.png -o a.png --size 3xx", 2,
                   "--size: '3xx' is not WxH, W or xH");
    expect_refusal("relit render map.png -o a.png --set relief", 2,
                   "--set: 'relief' is not field=value");
    expect_refusal("relit render - -o - --alpha -", 2, "stdin (-) can be one input only");
    expect_refusal("relit render map.png -o a.png --server ftp://host", 2,
                   "--server: 'ftp://host' is not http://host:port or https://host");
}

TEST_F(CliRender, RefusesEmptyValuesNamingTheirFlag) {
    write("map.png", small_png());
    const std::string rest = ": is empty; see relit render --help";
    for (const std::string flag :
         {"--preset", "--scene", "--light", "--sun", "--env", "--alpha", "--albedo", "--bump",
          "--size", "--format", "--set", "--threads", "--server"})
        expect_refusal("relit render map.png -o a.png " + flag + " ''", 2, flag + rest);
    expect_refusal("relit render map.png -o ''", 2, "--output" + rest);
    expect_refusal("relit render --albedo= map.png -o a.png", 2, "--albedo" + rest);
    expect_refusal("relit render '' -o a.png", 2, "relief" + rest);
    expect_refusal("relit info map.png ''", 2, "files: is empty; see relit info --help");
    expect_refusal("relit samples ''", 2, "sample: is empty; see relit samples --help");
    EXPECT_EQ(names(), std::vector<std::string>{"map.png"});
}

TEST_F(CliRender, WritesToPipesAndDevicesDirectlyAndThroughLinks) {
    write("map.png", small_png());
    EXPECT_EQ(run("relit render map.png -o /dev/null").status, 0);
    EXPECT_EQ(run("mkfifo pipe; relit render map.png -o pipe & cat pipe > copy.png; wait").status,
              0);
    EXPECT_EQ(run("relit render map.png -o real.png && ln -s real.png link.png && "
                  "relit render map.png --preset ink -o link.png")
                  .status,
              0);
    EXPECT_TRUE(std::filesystem::is_symlink(folder.path() / "link.png"));
    EXPECT_NE(read("real.png"), read("copy.png"));
    EXPECT_EQ(decode(read("copy.png")).info.width, 16);
}

TEST_F(CliRender, FailsWithoutWordsWhenNobodyReadsItsPicture) {
    const Ran ran = run("relit render sample:plato -o - | head -c 1 | wc -c");
    EXPECT_EQ(ran.status, 3);
    EXPECT_EQ(ran.out, "1\n");
    EXPECT_EQ(ran.err, "");
}

TEST_F(CliScene, IsADryRunThatNamesThePicture) {
    write("map.png", small_png());
    const Ran scene = run("relit scene map.png --preset wax --format jpeg > s.json; cat s.json");
    ASSERT_EQ(scene.status, 0) << scene.err;
    const Ran etag = run("relit scene map.png --preset wax --format jpeg --etag");
    EXPECT_EQ(etag.out.size(), 35u) << etag.out;
    EXPECT_EQ(run("relit scene map.png --scene s.json --etag").out, etag.out);
    EXPECT_NE(run("relit scene map.png --scene s.json --etag --set relief=1").out, etag.out);
    run("relit render map.png --preset wax -o a.jpg; relit render map.png --scene s.json -o b.jpg");
    EXPECT_FALSE(read("a.jpg").empty());
    EXPECT_EQ(read("a.jpg"), read("b.jpg"));
    write("cut.png", small_png().substr(0, 60));
    expect_refusal("relit scene cut.png", 1, "cut.png: the PNG file is broken: it ends too early");
}

}  // namespace
}  // namespace relit::test
