// A folder of a test's own, in which relit runs: the fixture of most tests of the command line.
#pragma once

#include <gtest/gtest.h>

#include <fstream>

#include "tests/cli/support/cli_process.h"
#include "tests/support/data.h"
#include "tests/support/temporary_folder.h"

namespace relit::test {

class CliFolder : public testing::Test {
protected:
    /// A shell command in the folder.
    Ran run(const std::string& command, const std::string& input = "") const {
        return shell(command, folder.path(), input);
    }
    /// The command ends with `status` and says nothing but that.
    void expect_refusal(const std::string& command, int status, const std::string& words,
                        const std::string& input = "") const {
        const Ran ran = run(command, input);
        EXPECT_EQ(ran.status, status) << command << '\n' << ran.err;
        EXPECT_EQ(ran.err, "relit: " + words + "\n") << command;
        EXPECT_EQ(ran.out, "") << command;
    }
    void write(const std::string& name, const std::string& bytes) const {
        std::ofstream(folder.path() / name, std::ios::binary) << bytes;
    }
    [[nodiscard]] std::string read(const std::string& name) const {
        return read_file(folder.path() / name);
    }

    TemporaryFolder folder;
};

}  // namespace relit::test
