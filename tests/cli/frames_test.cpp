// relit sweep and relit batch: many pictures, each whole or not at all, none made twice, the same here
// and from a server.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <map>
#include <thread>

#include "tests/cli/support/cli_folder.h"
#include "tests/support/data.h"
#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

using Files = std::map<std::string, std::string>;  // name -> bytes

class CliFrames : public CliFolder {
protected:
    // What a folder shows; what it hides is the records alone.
    [[nodiscard]] Files files(const std::string& name) const {
        Files files;
        for (const auto& entry : fs::directory_iterator(folder.path() / name)) {
            const std::string file = entry.path().filename().string();
            if (file.front() != '.') files[file] = read_file(entry.path());
            else EXPECT_TRUE(file.starts_with(".relit-frames")) << file;
        }
        return files;
    }
};

const std::string orbit = "relit sweep sample:plato --orbit 8 --elevation 30 --size 32 ";

std::string url_of(const RelitProcess& relitd) {
    return " --server http://127.0.0.1:" + std::to_string(relitd.port());
}

std::string batches_of(const RelitProcess& relitd) {
    return http(relitd.port(), "GET", "/v1/batches").body;
}

TEST_F(CliFrames, AreWhatRenderMakesOfEachScene) {
    ASSERT_EQ(run(orbit + "-o f").status, 0);
    const Files frames = files("f");
    EXPECT_EQ(frames.size(), 8u);
    ASSERT_EQ(run("relit render sample:plato --size 32 --sun 45,30 -o sun.png").status, 0);
    EXPECT_EQ(frames.at("0002.png"), read_file(folder.path() / "sun.png"))
        << "an orbit begins at azimuth 315 and goes on by 45 degrees a frame";
}

TEST_F(CliFrames, AreMadeWhereTheyAreMissingAndNowhereElse) {
    ASSERT_EQ(run(orbit + "-o f").status, 0);
    const Files whole = files("f");
    const auto time_of = [&](const char* name) {
        return fs::last_write_time(folder.path() / "f" / name);
    };
    const auto untouched = time_of("0000.png");
    fs::remove(folder.path() / "f/0003.png");
    write("f/0004.png", whole.at("0004.png").substr(0, 50));
    write("f/0005.png", whole.at("0006.png"));
    const Ran again = run(orbit + "-o f");
    EXPECT_EQ(again.status, 0);
    EXPECT_EQ(again.err, "relit: 5 of 8 frames are there already\n");
    EXPECT_EQ(files("f"), whole);
    EXPECT_EQ(time_of("0000.png"), untouched);
    EXPECT_EQ(run(orbit + "-o f --quiet").err, "");
}

TEST_F(CliFrames, OfAnotherSceneAreMadeAnewUnderTheSameNames) {
    ASSERT_EQ(run(orbit + "-o f").status, 0);
    const Files plaster = files("f");
    const Ran bronze = run(orbit + "-o f --preset bronze");
    EXPECT_EQ(bronze.err, "");
    EXPECT_NE(files("f").at("0001.png"), plaster.at("0001.png"));
    EXPECT_EQ(run(orbit + "-o f").err, "") << "bronze is no plaster";
    EXPECT_EQ(files("f"), plaster);
}

TEST_F(CliFrames, AreTheSameFromAServerWhichForgetsThemAfterwards) {
    const RelitProcess relitd;
    write("map.png", small_png());
    for (const std::string& sweep :
         {std::string("sample:plato --orbit 5 --turns -1"),
          std::string("map.png --arc 4 --from 90,5 --to 270,5 --easing ease-in-out --format webp"),
          std::string("map.png --line 6 --from 0,1,0.5 --to 1,1,0.5 --returns"),
          std::string("map.png --env sample:rainbow --turn 3")}) {
        SCOPED_TRACE(sweep);
        for (const char* target : {"here", "there"}) fs::remove_all(folder.path() / target);
        ASSERT_EQ(run("relit sweep " + sweep + " --size 32 -o here").status, 0);
        const Ran there = run("relit sweep " + sweep + " --size 32 -o there" + url_of(relitd));
        ASSERT_EQ(there.status, 0) << there.err;
        EXPECT_GT(files("here").size(), 2u);
        EXPECT_EQ(files("here"), files("there"));
    }
    EXPECT_EQ(batches_of(relitd), R"({"batches":[],"next":null})");
}

TEST_F(CliFrames, AreSeveralBatchesWhereAServerTakesNoLargeOnes) {
    const RelitProcess relitd({.flags = {"--max-batch-frames=3"}});
    ASSERT_EQ(run(orbit + "-o here").status, 0);
    const Ran there = run(orbit + "-o there" + url_of(relitd));
    EXPECT_EQ(there.status, 0) << there.err;
    EXPECT_EQ(files("there"), files("here"));
}

TEST_F(CliFrames, ThatFailAreToldAndDoNotStopTheOthers) {
    const RelitProcess relitd;
    write("map.png", small_png());
    write("broken.png", small_png().substr(0, 60));
    write("m.jsonl",
          R"({"height": {"part": "map.png"}, "output": {"width": 16}}
{"name": "b.jpg", "scene": {"height": {"part": "map.png"}}}

{"name": "c.png", "scene": {"height": {"part": "broken.png"}}}
{"name": "d.png", "height": {"part": "map.png"}, "output": {"region": [0, 0, 9999, 1]}}
{"name": "e.exr", "height": {"image": "plato"}, "output": {"width": 16}}
)");
    const Ran here = run("relit batch m.jsonl -o here --threads 1");
    const Ran there = run("relit batch m.jsonl -o there" + url_of(relitd));
    for (const Ran& ran : {here, there}) {
        EXPECT_EQ(ran.status, 1);
        EXPECT_NE(ran.err.find("relit: c.png: broken.png: "), std::string::npos) << ran.err;
        EXPECT_NE(ran.err.find("relit: d.png: 'output.region' reaches beyond the map of"),
                  std::string::npos)
            << ran.err;
        EXPECT_TRUE(ran.err.ends_with("relit: 2 of 5 frames failed\n")) << ran.err;
    }
    EXPECT_EQ(files("here").size(), 3u);
    EXPECT_EQ(files("here"), files("there"));
    EXPECT_TRUE(files("here").contains("0000.png"));
    write("broken.png", small_png());
    const Ran mended = run("relit batch m.jsonl -o there" + url_of(relitd));
    EXPECT_EQ(mended.err.substr(0, 39), "relit: 3 of 5 frames are there already\n");
    EXPECT_TRUE(files("there").contains("c.png"));
}

TEST_F(CliFrames, ComeInShardsThatAreTheWholeTogether) {
    ASSERT_EQ(run(orbit + "-o whole").status, 0);
    for (const char* shard : {"0/3", "1/3", "2/3"})
        EXPECT_EQ(run(orbit + "-o parts --shard " + shard).err, "");
    EXPECT_EQ(files("parts"), files("whole"));
    EXPECT_EQ(run(orbit + "-o parts").err, "relit: 8 of 8 frames are there already\n");
    for (const std::string bad : {"3/3", "1", "-1/3", "1/0", "a/b", "1/3x"})
        expect_refusal(orbit + "-o parts --shard " + bad, 2,
                       "--shard: '" + bad + "' is not i/n, from 0/n to n-1/n");
}

TEST_F(CliFrames, RefuseWhatCannotBe) {
    const std::string sweep = "relit sweep sample:plato -o f ";
    expect_refusal(sweep, 2, "sweep takes one of --orbit, --arc, --line and --turn");
    expect_refusal(sweep + "--orbit 0", 1,
                   "'sweep.count' must be a whole number from 1 to 1000000");
    expect_refusal(sweep + "--arc 3", 1, "'sweep.from' is missing");
    expect_refusal(sweep + "--turn 3", 1,
                   "frame 0: 'sweep.path' must not be 'environment' where the light is none");
    expect_refusal("relit batch m.jsonl -o f", 3,
                   "m.jsonl: cannot read it: no such file or directory");
    expect_refusal("relit batch - -o f", 1, "stdin: has no scenes", "\n\n");
    expect_refusal("relit batch - -o f", 1,
                   "stdin, line 2: 'relief' must be a number above 0 and at most 10",
                   "\n{\"height\": {\"image\": \"plato\"}, \"relief\": 0}");
    expect_refusal("relit batch - -o f", 3,
                   "stdin, line 1: none.png: cannot read it: no such file or directory",
                   R"({"height": {"part": "none.png"}})");
    expect_refusal("relit batch - -o f", 1,
                   "stdin, line 1: 'scene' must be alone or with 'name': it is a whole scene",
                   R"({"scene": {}, "height": {"image": "plato"}})");
    const std::string named = R"({"height": {"image": "plato"}, "name": )";
    expect_refusal("relit batch - -o f", 1, "stdin: frame 1: the name 'A.png' is there twice",
                   named + "\"a.png\"}\n" + named + "\"A.png\"}");
    EXPECT_EQ(run("relit batch - -o f", named + "\"../a.png\"}").status, 1);
    expect_refusal("relit batch - -o f", 2,
                   "stdin, line 1: a.jpg: the name says jpeg, output.format says exr; "
                   "output.format jpeg or another name settles it",
                   named + R"("a.jpg", "output": {"format": "exr"}})");
    expect_refusal("relit batch - -o f", 2,
                   "stdin, line 1: a.bmp: '.bmp' is no picture's ending; there are .png, .jpg, "
                   ".webp and .exr, or say output.format",
                   named + "\"a.bmp\"}");
    EXPECT_FALSE(fs::exists(folder.path() / "f")) << "nothing of it begins";
    expect_refusal(orbit + "-o -", 2, "-: frames go into a folder, not to stdout");
    write("file", "");
    expect_refusal(orbit + "-o file", 3, "file: is no folder");
    write("0000.png", small_png());
    expect_refusal("relit sweep 0000.png --orbit 3 -o .", 2,
                   "./0000.png: is an input too; give the frames another folder");
}

std::size_t entries_in(const fs::path& folder) {
    std::error_code ignored;
    const fs::directory_iterator entries(folder, ignored);
    return std::size_t(std::distance(begin(entries), end(entries)));
}

void wait_for_entries(const fs::path& folder, std::size_t count) {
    for (int i = 0; i < 3000 && entries_in(folder) < count; ++i) std::this_thread::sleep_for(10ms);
}

TEST_F(CliFrames, SayHowFarTheyAreAndStopAtOnce) {
    OnTerminal relit({"relit", "sweep", "sample:plato", "--orbit", "5000", "-o", "f"},
                     folder.path());
    ASSERT_TRUE(relit.shows(" % [")) << relit.screen();
    ASSERT_TRUE(relit.shows(" of 5000, ")) << relit.screen();
    ASSERT_TRUE(relit.shows(" left, ", 120s)) << relit.screen();
    const auto began = std::chrono::steady_clock::now();
    relit.type("\x03");
    EXPECT_EQ(relit.exit_status(), 130);
    EXPECT_LT(std::chrono::steady_clock::now() - began, 500ms);
    for (const auto& [name, bytes] : files("f"))
        EXPECT_TRUE(bytes.ends_with("IEND\xae\x42\x60\x82"));
}

TEST_F(CliFrames, OutliveAServerThatIsKilledAndComesBack) {
    const TemporaryFolder data;
    const auto sweep = [](const std::string& target) {
        return "relit sweep sample:plato --orbit 60 --size 96 -o " + target;
    };
    ASSERT_EQ(run(sweep("here")).status, 0);
    RelitProcess first({.data_dir = data.path()});
    const std::string port = std::to_string(first.port());
    OnTerminal relit({"bash", "-c", "exec " + sweep("there") + url_of(first)}, folder.path());
    wait_for_entries(folder.path() / "there", 10);
    first.signal(SIGKILL);
    (void)first.exit_status();
    const RelitProcess second(
        {.flags = {"--host=127.0.0.1", "--port=" + port, "--data-dir=" + data.path().string()},
         .with_usual_flags = false});
    EXPECT_EQ(relit.exit_status(120s), 0) << relit.screen();
    EXPECT_NE(relit.screen().find("cannot be reached"), std::string::npos) << relit.screen();
    EXPECT_TRUE(files("there") == files("here"));
    EXPECT_EQ(batches_of(second), R"({"batches":[],"next":null})");
}

struct Killed {
    int times = 0;
    int status = -1;  // of the last run, which nobody killed
};

// Starts a program, lets it get somewhere and kills it, again and again, then lets it end by itself.
Killed killed_and_resumed(const std::string& command, const fs::path& folder,
                          const fs::path& frames, int kills) {
    Killed killed;
    for (int kill = 0; kill < kills; ++kill) {
        const std::size_t enough = entries_in(frames) + 40;
        OnTerminal program({"bash", "-c", "exec " + command}, folder);
        wait_for_entries(frames, enough);
        program.signal(kill % 2 == 0 ? SIGKILL : SIGINT);
        if (program.exit_status() != 0) ++killed.times;
    }
    killed.status = shell(command, folder).status;
    return killed;
}

TEST_F(CliFrames, OfALongSweepAreTheSameHoweverOftenItIsKilledHereOrOnAServer) {
    const RelitProcess relitd;
    const std::string sweep = "relit sweep sample:plato --orbit 300 --size 96 ";
    const std::string python = std::string("python3 ") + RELIT_SOURCE_DIR +
                               "/tests/python/support/sweep.py python 300" +
                               url_of(relitd).substr(9);
    ASSERT_EQ(run(sweep + "-o undisturbed").status, 0);
    const std::map<std::string, std::string> commands = {
        {"here", sweep + "-o here"},
        {"there", sweep + "-o there" + url_of(relitd)},
        {"python", python}};
    for (const auto& [target, command] : commands) {
        const Killed killed = killed_and_resumed(command, folder.path(), folder.path() / target, 3);
        EXPECT_EQ(killed.times, 3) << target << " was done before it was killed";
        EXPECT_EQ(killed.status, 0) << target;
    }
    const Files undisturbed = files("undisturbed");
    EXPECT_EQ(undisturbed.size(), 300u);
    for (const char* target : {"here", "there", "python"}) {
        for (const auto& entry : fs::directory_iterator(folder.path() / target))
            if (entry.path().filename().string().starts_with(".relit-")) fs::remove(entry.path());
        EXPECT_TRUE(files(target) == undisturbed) << target;
    }
    EXPECT_EQ(batches_of(relitd), R"({"batches":[],"next":null})");
}

}  // namespace
}  // namespace relit::test
