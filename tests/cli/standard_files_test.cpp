// relit and relitd whose caller has closed stdin, stdout or stderr: their own descriptors never
// take the place of these. And pictures written to what the caller holds open.
#include <gtest/gtest.h>

#include "core/io/decode.h"
#include "tests/cli/support/cli_folder.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

class CliStandardFiles : public CliFolder {
protected:
    CliStandardFiles() { write("map.png", small_png()); }
    // Within 20 s: what waits for ever is a failure.
    Ran run(const std::string& command) const {
        return CliFolder::run("shopt -s expand_aliases; alias relit='timeout 20 relit'\n" + command);
    }
    void expect_failure(const std::string& command, const std::string& words) const {
        const Ran ran = run(command);
        EXPECT_EQ(ran.status, 3) << command;
        EXPECT_EQ(ran.err, "relit: " + words + ": bad file descriptor\n") << command;
        EXPECT_EQ(ran.out, "") << command;
    }
};

TEST_F(CliStandardFiles, AClosedStdinHoldsNothingToRead) {
    expect_failure("relit render - -o a.png <&-", "stdin: cannot read it");
    expect_failure("relit render map.png --scene - -o a.png <&-", "stdin: cannot read it");
    expect_failure("relit info - <&-", "stdin: cannot read it");
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.png"));
}

TEST_F(CliStandardFiles, AClosedStdoutTakesNoPicture) {
    expect_failure("relit render map.png -o - >&-", "stdout: cannot write it");
    expect_failure("relit render map.png -o /dev/stdout >&-", "/dev/stdout: cannot write it");
    expect_failure("relit render map.png -o - <&- >&-", "stdout: cannot write it");
    expect_failure("relit presets >&-", "stdout: cannot write it");
    EXPECT_EQ(run("relit --help >&-").status, 3);
}

TEST_F(CliStandardFiles, NothingIsSaidIntoAnythingElseWhenStderrIsClosed) {
    EXPECT_EQ(run("relit render map.png -o a.png <&- >&- 2>&-").status, 0);
    EXPECT_EQ(decode(read("a.png")).info.width, 16);
    const Ran refused = run("relit render map.png -o b.png --set nothing=1 2>&-");
    EXPECT_EQ(refused.status, 1);
    EXPECT_EQ(refused.out, "");
}

TEST_F(CliStandardFiles, TheServerHoldsThemToo) {
    const Ran ran =
        run("relitd --port 0 --data-dir data <&- >&- 2>&- & pid=$!\n"
            "for i in {1..200}; do [ -d data ] && break; sleep 0.05; done\n"
            "readlink /proc/$pid/fd/{0,1,2}; kill $pid; wait $pid");
    EXPECT_EQ(ran.out, "/dev/null\n/dev/null\n/dev/null\n");
    EXPECT_EQ(ran.status, 0) << ran.err;
}

TEST_F(CliStandardFiles, WhatTheCallerHoldsOpenIsWrittenWhereItStands) {
    ASSERT_EQ(run("relit render map.png -o a.png; ln -s /dev/stdout link").status, 0);
    const std::string kept = "kept\n" + read("a.png");
    for (const std::string target : {"/dev/stdout >>", "/dev/fd/1 >>", "/proc/self/fd/1 >>",
                                     "link >>", "/dev/fd/7 7>>", "/dev/stderr --quiet 2>>"}) {
        const Ran ran = run("echo kept > out; relit render map.png -o " + target + " out");
        EXPECT_EQ(ran.status, 0) << target << ran.err;
        EXPECT_EQ(read("out"), kept) << target;
    }
    EXPECT_EQ(run("{ echo kept; relit render map.png -o /dev/stdout; } > out").status, 0);
    EXPECT_EQ(read("out"), kept);
    EXPECT_EQ(run("relit render map.png -o /dev/stdout | cat").out, read("a.png"));
    EXPECT_TRUE(std::filesystem::is_symlink(folder.path() / "link"));
}

// relit opens some of these itself.
TEST_F(CliStandardFiles, DescriptorsThatTheCallerHasNotOpenedAreNoTargets) {
    for (const std::string number : {"3", "4", "5", "6"})
        expect_failure("relit render map.png -o /dev/fd/" + number + " " + number + ">&-",
                       "/dev/fd/" + number + ": cannot write it");
    expect_failure("relit render map.png -o /dev/fd/7 7< map.png", "/dev/fd/7: cannot write it");
    OnTerminal terminal({"relit", "render", "map.png", "-o", "/dev/stdout"}, folder.path());
    EXPECT_EQ(terminal.exit_status(), 2);
    EXPECT_NE(terminal.screen().find("/dev/stdout is a terminal"), std::string::npos);
}

}  // namespace
}  // namespace relit::test
