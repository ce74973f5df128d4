// relit with servers that ask for keys, and relit sign-url.
#include <gtest/gtest.h>

#include "tests/cli/support/cli_folder.h"
#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"

namespace relit::test {
namespace {

constexpr const char* key = "cli-key-0123456789";
const std::string target =
    "/v1/images/c19f4389c237ad9b4f5e8e7ab97c7e4770f41eee5cedf994967fa8e5eca91908/"
    "relit.jpg?sun=300,40&output.width=32";

class CliKeys : public CliFolder {
protected:
    CliKeys() {
        const auto file = folder.path() / "keys";
        write("keys", std::string(key) + " render\n");
        std::filesystem::permissions(file, std::filesystem::perms(0600));
        relitd = std::make_unique<RelitProcess>(
            RelitProcess::Settings{.flags = {"--api-keys=" + file.string()}});
        url = "http://127.0.0.1:" + std::to_string(relitd->port());
    }
    std::unique_ptr<RelitProcess> relitd;
    std::string url;
};

TEST_F(CliKeys, TheServerGetsTheOneOfTheEnvironment) {
    const std::string render = "relit render sample:plato -o a.png --size 32 --server " + url;
    const Ran without = run(render);
    EXPECT_EQ(without.status, 1);
    EXPECT_NE(without.err.find("API key"), std::string::npos) << without.err;
    const Ran with = run("RELIT_API_KEY=" + std::string(key) + " " + render);
    EXPECT_EQ(with.status, 0) << with.err;
}

TEST_F(CliKeys, ASignedUrlNeedsNone) {
    const std::string sign = "RELIT_API_KEY=" + std::string(key) + " relit sign-url ";
    const Ran whole = run(sign + "'" + url + target + "' --valid 60");
    ASSERT_EQ(whole.status, 0) << whole.err;
    ASSERT_TRUE(whole.out.starts_with(url + target + "&expires=")) << whole.out;
    const std::string signed_target =
        whole.out.substr(url.size(), whole.out.size() - url.size() - 1);
    EXPECT_EQ(http(relitd->port(), "GET", signed_target).status, 200);
    EXPECT_EQ(http(relitd->port(), "GET", target).status, 401);
    const Ran path = run(sign + "/v1/samples");
    ASSERT_TRUE(path.out.starts_with("/v1/samples?expires=")) << path.out << path.err;
    EXPECT_EQ(http(relitd->port(), "GET", path.out.substr(0, path.out.size() - 1)).status, 200);
}

TEST_F(CliKeys, WhatCannotBeSignedIsRefused) {
    const std::string sign = "RELIT_API_KEY=" + std::string(key) + " relit sign-url ";
    for (const std::string command :
         {"relit sign-url /v1/samples", "RELIT_API_KEY= relit sign-url /v1/samples"}) {
        const Ran ran = run(command);
        EXPECT_EQ(ran.status, 2) << command;
        EXPECT_NE(ran.err.find("RELIT_API_KEY"), std::string::npos) << ran.err;
    }
    for (const std::string unfit : {"https://example.org", "example.org/a", "'/a b'", "'/a#b'",
                                    "/é", "'/a?expires=1'", "'/a?b=1&signature=0'", "/a --valid 0"})
        EXPECT_EQ(run(sign + unfit).status, 2) << unfit;
}

}  // namespace
}  // namespace relit::test
