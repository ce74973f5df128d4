// relit info, presets, media, samples, completion, --help; and what clients/cli/README.md shows.
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <regex>
#include <sstream>

#include "core/scatter/medium.h"
#include "server/schema/presets.h"
#include "tests/cli/support/cli_process.h"
#include "tests/support/data.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

namespace fs = std::filesystem;

const fs::path samples = fs::path(RELIT_SOURCE_DIR) / "server/samples";

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST(CliInfo, TellsSizeTypeIdAndRangeOfHeights) {
    const Ran ran = shell("relit info plato.png - < st-helens.tif", samples);
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(ran.out,
              "plato.png\n"
              "  png, 512 x 512, grey and alpha of uint16, 132446 bytes\n"
              "  id c19f4389c237ad9b4f5e8e7ab97c7e4770f41eee5cedf994967fa8e5eca91908\n"
              "  heights 0 to 1 of the largest uint16\n"
              "  176420 texels masked by alpha\n"
              "stdin\n"
              "  tiff, 317 x 460, grey of float32, 219730 bytes\n"
              "  id 2895dfd3abe6af1c66ea338167ade753fd611d97a08bdbc9aa2bb09558756b71\n"
              "  heights 694 to 2543\n");
    const Ran json = shell("relit info sample:st-helens --json | tr -d ' \\n'", samples);
    EXPECT_EQ(json.out,
              R"([{"file":"sample:st-helens",)"
              R"("id":"2895dfd3abe6af1c66ea338167ade753fd611d97a08bdbc9aa2bb09558756b71",)"
              R"("width":317,"height":460,"channels":1,"type":"float32","format":"tiff",)"
              R"("bytes":219730,"heightRange":[694.0,2543.0],"notFinite":0,"masked":0}])");
}

TEST(CliInfo, CountsTexelsWithoutAHeight) {
    const TemporaryFolder folder;
    Image map(4, 3, 1, 0.25f);
    map.at(1, 1) = std::numeric_limits<float>::quiet_NaN();
    map.at(2, 2) = std::numeric_limits<float>::infinity();
    map.at(3, 2) = -7;
    std::ofstream(folder.path() / "map.exr", std::ios::binary)
        << encoded(map, {.format = PictureFormat::exr, .bit_depth = 32});
    const Ran ran = shell("relit info map.exr", folder.path());
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_TRUE(contains(ran.out, "heights -7 to 0.25\n  2 texels without a height\n")) << ran.out;
}

TEST(CliInfo, NamesTheFileThatItCannotRead) {
    const Ran broken = shell("relit info README.md", samples);
    EXPECT_EQ(broken.status, 1);
    EXPECT_TRUE(broken.err.starts_with("relit: README.md: ")) << broken.err;
    EXPECT_EQ(shell("relit info none.png", samples).status, 3);
}

TEST(CliInfo, TellsOfTheOthersWhenAFileCannotBeRead) {
    for (const std::string flag : {"", " --json"}) {
        const std::string command = "relit info --quiet" + flag;
        const Ran good = shell(command + " plato.png fish.png", samples);
        const Ran mixed = shell(command + " plato.png README.md fish.png none.png", samples);
        EXPECT_EQ(good.status, 0);
        EXPECT_EQ(mixed.status, 1);
        EXPECT_FALSE(good.out.empty());
        EXPECT_EQ(mixed.out, good.out);
        EXPECT_TRUE(mixed.err.starts_with("relit: README.md: ")) << mixed.err;
        EXPECT_TRUE(
            mixed.err.ends_with("\nrelit: none.png: cannot read it: no such file or directory\n"))
            << mixed.err;
    }
    EXPECT_EQ(shell("relit info --json README.md", samples).out, "[]\n");
}

TEST(CliLists, PresetsMediaAndSamplesAreAllNamed) {
    const Ran presets = shell("relit presets", samples);
    const Ran json = shell("relit presets --json", samples);
    EXPECT_EQ(presets.status + json.status, 0);
    for (const server::PresetInfo& preset : server::preset_list()) {
        EXPECT_TRUE(contains("\n" + presets.out, "\n" + std::string(preset.name) + " "));
        EXPECT_TRUE(contains(json.out, "\"name\": \"" + std::string(preset.name) + '"'));
    }
    const Ran media = shell("relit media; relit media --json", samples);
    for (const scatter::NamedMedium& medium : scatter::measured_media()) {
        EXPECT_TRUE(contains("\n" + media.out, "\n" + std::string(medium.name) + " "));
        EXPECT_TRUE(contains(media.out, "\"name\": \"" + std::string(medium.name) + '"'));
    }
    const Ran listed = shell("relit samples; relit samples --json", samples);
    for (const char* name : {"plato", "head", "fish", "st-helens", "venice-sunset", "rainbow"}) {
        EXPECT_TRUE(contains("\n" + listed.out, "\n" + std::string(name) + " "));
        EXPECT_TRUE(contains(listed.out, "\"name\": \"" + std::string(name) + '"'));
    }
}

TEST(CliLists, ASampleIsWrittenAsItIs) {
    const TemporaryFolder folder;
    EXPECT_EQ(shell("relit samples plato -o a.png", folder.path()).status, 0);
    EXPECT_EQ(read_file(folder.path() / "a.png"), read_file(samples / "plato.png"));
    EXPECT_EQ(shell("relit samples fish -o -", folder.path()).out, read_file(samples / "fish.png"));
    EXPECT_EQ(shell("relit samples plato", folder.path()).status, 2);
}

TEST(CliHelp, HasExamples) {
    EXPECT_EQ(shell("relit --version", samples).out, "relit " RELIT_VERSION "\n");
    EXPECT_TRUE(contains(shell("relit --help", samples).out, "Exit status: 0 done"));
    for (const char* command : {"render", "samples"}) {
        const Ran ran = shell(std::string("relit ") + command + " --help", samples);
        EXPECT_EQ(ran.status, 0);
        EXPECT_TRUE(contains(ran.out, std::string("Examples:\n  relit ") + command)) << ran.out;
    }
}

// Completion in an interactive bash: keys in, the line that it makes of them out.
class CliCompletion : public testing::Test {
protected:
    void SetUp() override {
        write("relief-one.png");
        write("my scene.json");
        bash_.type("PS1='> '; bind 'set enable-bracketed-paste off' 'set bell-style none'\r");
        bash_.type("source <(relit completion bash); bind 'set show-all-if-ambiguous on'\r");
        bash_.type("echo rea''dy\r");
        ASSERT_TRUE(bash_.shows("ready")) << bash_.screen();
        ASSERT_TRUE(bash_.shows("> ")) << bash_.screen();
    }
    void write(const std::string& name) const { std::ofstream(folder_.path() / name) << "x"; }

    // Whether `expected` comes on the screen after `keys` and a Tab.
    testing::AssertionResult completes(const std::string& keys, const std::string& expected) {
        bash_.forget();
        bash_.type(keys + "\t");
        const bool shown = bash_.shows(expected, std::chrono::seconds(5));
        const std::string screen = bash_.screen();
        bash_.type("\x15");  // Ctrl-U: an empty line again
        bash_.type("echo ne''xt\r");
        if (!bash_.shows("next\r\n> ")) return testing::AssertionFailure() << "bash hangs";
        if (shown) return testing::AssertionSuccess();
        return testing::AssertionFailure() << keys << " gave: " << screen;
    }

    TemporaryFolder folder_;
    OnTerminal bash_{{"bash", "--norc", "--noprofile", "-i"}, folder_.path()};
};

TEST_F(CliCompletion, KnowsCommandsFlagsNamesAndFieldsInBash) {
    EXPECT_TRUE(completes("relit ren", "relit render "));
    EXPECT_TRUE(completes("relit --ver", "relit --version "));
    EXPECT_TRUE(completes("relit render --alb", "--albedo "));
    EXPECT_TRUE(completes("relit render --preset bro", "bronze "));
    EXPECT_TRUE(completes("relit render --preset=bro", "--preset=bronze "));
    EXPECT_TRUE(completes("relit render --format w", "webp "));
    EXPECT_TRUE(completes("relit sweep --easing ease-o", "ease-out "));
    EXPECT_TRUE(completes("relit batch --sha", "--shard "));
    EXPECT_TRUE(completes("relit sweep --animation-quality l", "lossless "));
    EXPECT_TRUE(completes("relit render rel", "relief-one.png "));
    EXPECT_TRUE(completes("relit render relief-one.png -o rel", "-o relief-one.png "));
    EXPECT_TRUE(completes("relit render --scene my", "my\\ scene.json "));
    EXPECT_TRUE(completes("relit render --scene my\\ sc", "my\\ scene.json "));
    EXPECT_TRUE(completes("relit render sample:pl", "sample:plato "));
    EXPECT_TRUE(completes("relit render x.png --env sample:ven", "sample:venice-sunset "));
    EXPECT_TRUE(completes("relit render --set material.specular.k", "material.specular.k="));
    EXPECT_TRUE(completes("relit render --set light.ty", "light.type="));
    EXPECT_TRUE(completes("relit render --set output.tone=f", "output.tone=filmic "));
    EXPECT_TRUE(completes("relit scene --et", "--etag "));
    EXPECT_TRUE(completes("relit samples st", "st-helens "));
    EXPECT_TRUE(completes("relit completion z", "zsh "));
}

// The other shells are asked for what they would offer.
TEST(CliCompletionScript, OffersTheSameInZsh) {
    if (shell("command -v zsh", samples).status != 0) GTEST_SKIP() << "there is no zsh";
    const TemporaryFolder folder;
    const Ran zsh = shell(R"(relit completion zsh > _relit && zsh -f -c '
        fpath=($PWD $fpath); autoload -Uz compinit; compinit -u -d dump
        source ./_relit
        compadd() { [[ $1 == -a ]] && print -l "${(@P)2}"; [[ $1 == -S ]] && print -l "${(@P)4}" }
        _files() { print FILES }
        compset() { :; }
        _relit_complete "" render --preset; _relit_complete output.tone= render --set
        _relit_complete "" render; _relit_complete "" ')",
                          folder.path());
    for (const char* word : {"bronze\n", "material.depth=\n", "output.tone=filmic\n",
                             "sample:plato\n", "FILES\n", "completion\n"})
        EXPECT_TRUE(contains(zsh.out, word)) << word << zsh.out << zsh.err;
}

TEST(CliCompletionScript, OffersTheSameInFish) {
    if (shell("command -v fish", samples).status != 0) GTEST_SKIP() << "there is no fish";
    const TemporaryFolder folder;
    const Ran fish = shell(R"(touch relief-one.png; relit completion fish > r.fish
        fish --no-config -c '
            source r.fish
            complete -C "relit re"; complete -C "relit render --preset bro"
            complete -C "relit render --set output.tone=f"; complete -C "relit render rel"')",
                           folder.path());
    for (const char* word : {"render\t", "bronze", "output.tone=filmic", "relief-one.png"})
        EXPECT_TRUE(contains(fish.out, word)) << word << fish.out << fish.err;
}

TEST(CliCompletionScript, IsRefusedForShellsThatAreNotKnown) {
    EXPECT_EQ(shell("relit completion tcsh", samples).status, 2);
}

// --- README --------------------------------------------------------------------------------------

struct Example {
    std::string command;
    std::string shown;  // "…" stands for anything
};

std::vector<Example> examples_of(const fs::path& readme) {
    std::vector<Example> examples;
    std::istringstream lines(read_file(readme));
    bool inside = false;
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("```")) inside = line == "```console";
        else if (inside && line.starts_with("$ ")) examples.push_back({line.substr(2), ""});
        else if (inside && !examples.empty()) examples.back().shown += line + "\n";
    }
    return examples;
}

std::string pattern_of(const std::string& shown) {
    static const std::regex special(R"([.^$|()\[\]{}*+?\\])");
    const std::string literal = std::regex_replace(shown, special, R"(\$&)");
    return std::regex_replace(literal, std::regex("…"), "[^\n]*");
}

TEST(CliReadme, ShowsWhatHappens) {
    const TemporaryFolder folder;
    fs::copy_file(samples / "plato.png", folder.path() / "relief.png");
    fs::copy_file(samples / "st-helens.tif", folder.path() / "dem.tif");
    const auto examples = examples_of(fs::path(RELIT_SOURCE_DIR) / "clients/cli/README.md");
    ASSERT_GE(examples.size(), 6u);
    for (const Example& example : examples) {
        const Ran ran = shell(example.command, folder.path());
        EXPECT_TRUE(ran.status == 0 || !example.shown.empty()) << example.command << '\n'
                                                               << ran.err;
        EXPECT_TRUE(std::regex_match(ran.out + ran.err, std::regex(pattern_of(example.shown))))
            << example.command << "\nprints\n"
            << ran.out << ran.err;
    }
}

}  // namespace
}  // namespace relit::test
