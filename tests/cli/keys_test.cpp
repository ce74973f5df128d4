// relit with servers that ask for keys, and relit sign-url.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/cli/support/cli_process.h"
#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"
#include "tests/support/temporary_folder.h"

namespace relit::test {
namespace {

constexpr const char* key = "cli-key-0123456789";
const std::string target =
    "/v1/images/c19f4389c237ad9b4f5e8e7ab97c7e4770f41eee5cedf994967fa8e5eca91908/"
    "relit.jpg?sun=300,40&output.width=32";

class CliKeys : public testing::Test {
protected:
    CliKeys() {
        const auto file = folder.path() / "keys";
        std::ofstream(file) << key << " render\n";
        std::filesystem::permissions(file, std::filesystem::perms(0600));
        relitd = std::make_unique<RelitProcess>(
            RelitProcess::Settings{.flags = {"--api-keys=" + file.string()}});
        url = "http://127.0.0.1:" + std::to_string(relitd->port());
    }
    TemporaryFolder folder;
    std::unique_ptr<RelitProcess> relitd;
    std::string url;
};

TEST_F(CliKeys, TheServerGetsTheOneOfTheEnvironment) {
    const std::string render = "relit render sample:plato -o a.png --size 32 --server " + url;
    const Ran without = shell(render, folder.path());
    EXPECT_EQ(without.status, 1);
    EXPECT_NE(without.err.find("API key"), std::string::npos) << without.err;
    const Ran with = shell("RELIT_API_KEY=" + std::string(key) + " " + render, folder.path());
    EXPECT_EQ(with.status, 0) << with.err;
}

TEST_F(CliKeys, ASignedUrlNeedsNone) {
    const std::string sign = "RELIT_API_KEY=" + std::string(key) + " relit sign-url ";
    const Ran whole = shell(sign + "'" + url + target + "' --valid 60", folder.path());
    ASSERT_EQ(whole.status, 0) << whole.err;
    ASSERT_TRUE(whole.out.starts_with(url + target + "&expires=")) << whole.out;
    const std::string signed_target =
        whole.out.substr(url.size(), whole.out.size() - url.size() - 1);
    EXPECT_EQ(http(relitd->port(), "GET", signed_target).status, 200);
    EXPECT_EQ(http(relitd->port(), "GET", target).status, 401);
    const Ran path = shell(sign + "/v1/samples", folder.path());
    ASSERT_TRUE(path.out.starts_with("/v1/samples?expires=")) << path.out << path.err;
    EXPECT_EQ(http(relitd->port(), "GET", path.out.substr(0, path.out.size() - 1)).status, 200);
}

TEST_F(CliKeys, WhatCannotBeSignedIsRefused) {
    const std::string sign = "RELIT_API_KEY=" + std::string(key) + " relit sign-url ";
    for (const std::string command :
         {"relit sign-url /v1/samples", "RELIT_API_KEY= relit sign-url /v1/samples"}) {
        const Ran ran = shell(command, folder.path());
        EXPECT_EQ(ran.status, 2) << command;
        EXPECT_NE(ran.err.find("RELIT_API_KEY"), std::string::npos) << ran.err;
    }
    for (const std::string unfit : {"https://example.org", "example.org/a", "'/a b'", "'/a#b'",
                                    "/é", "'/a?expires=1'", "'/a?b=1&signature=0'", "/a --valid 0"})
        EXPECT_EQ(shell(sign + unfit, folder.path()).status, 2) << unfit;
}

}  // namespace
}  // namespace relit::test
