#include "server/config.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

namespace relit::server {
namespace {

// A variable for as long as it lives: the flags' library reads the process's environment.
class Variable {
public:
    Variable(std::string name, const std::string& value) : name_(std::move(name)) {
        ::setenv(name_.c_str(), value.c_str(), 1);
    }
    ~Variable() { ::unsetenv(name_.c_str()); }
    Variable(const Variable&) = delete;
    Variable& operator=(const Variable&) = delete;

private:
    std::string name_;
};

struct Outcome {
    ConfigOrExit result;
    std::string out, err;
};

Outcome read(std::vector<const char*> arguments, std::vector<const char*> environment = {}) {
    arguments.insert(arguments.begin(), "relitd");
    environment.push_back(nullptr);
    std::ostringstream out, err;
    auto result =
        read_config(int(arguments.size()), arguments.data(), environment.data(), out, err);
    return {std::move(result), out.str(), err.str()};
}

TEST(Config, DefaultsListenOnThisMachineOnly) {
    const auto [result, out, err] = read({});
    ASSERT_FALSE(result.exit_status) << err;
    EXPECT_EQ(result.config.host, "127.0.0.1");
    EXPECT_EQ(result.config.port, 8080);
    EXPECT_EQ(result.config.limits.max_image_bytes, 256u << 20);
    EXPECT_EQ(result.config.data_dir.filename(), "relit");
}

TEST(Config, DataFolderFollowsTheEnvironmentsConventions) {
    const Variable home("HOME", "/home/somebody");
    EXPECT_EQ(read({}).result.config.data_dir, "/home/somebody/.local/share/relit");
    const Variable data("XDG_DATA_HOME", "/srv/data");
    EXPECT_EQ(read({}).result.config.data_dir, "/srv/data/relit");
}

TEST(Config, FlagsGoBeforeVariablesBeforeDefaults) {
    const Variable port("RELIT_PORT", "1234");
    const Variable queue("RELIT_MAX_QUEUE", "7");
    const auto [result, out, err] =
        read({"--port", "4321"}, {"RELIT_PORT=1234", "RELIT_MAX_QUEUE=7"});
    ASSERT_FALSE(result.exit_status) << err;
    EXPECT_EQ(result.config.port, 4321);
    EXPECT_EQ(result.config.limits.max_queue, 7);
}

TEST(Config, SizesHaveUnitsAndTimesAreSeconds) {
    const auto [result, out, err] = read({"--max-image-bytes", "3MiB", "--max-body-bytes=4096",
                                          "--max-storage", "20GiB", "--stop-timeout=5"});
    ASSERT_FALSE(result.exit_status) << err;
    EXPECT_EQ(result.config.limits.max_image_bytes, 3u << 20);
    EXPECT_EQ(result.config.limits.max_body_bytes, 4096u);
    EXPECT_EQ(result.config.limits.max_storage_bytes, 20ull << 30);
    EXPECT_EQ(result.config.limits.stop_timeout, std::chrono::seconds(5));
}

TEST(Config, TheLogIsTextUnlessSaid) {
    EXPECT_EQ(read({}).result.config.log_format, LogFormat::text);
    EXPECT_EQ(read({}).result.config.log_slow.count(), 0);
    const Variable format("RELIT_LOG_FORMAT", "json");
    const auto [result, out, err] = read({"--log-slow=250"}, {"RELIT_LOG_FORMAT=json"});
    ASSERT_FALSE(result.exit_status) << err;
    EXPECT_EQ(result.config.log_format, LogFormat::json);
    EXPECT_EQ(result.config.log_slow, std::chrono::milliseconds(250));
}

TEST(Config, WhatTheDecoderIsHeldToIsSet) {
    const auto [result, out, err] = read({"--max-image-channels=3", "--max-image-values=1000",
                                          "--max-tile-bytes=4096", "--max-part-head-bytes=1KiB"});
    ASSERT_FALSE(result.exit_status) << err;
    const DecodeLimits decode = decode_limits(result.config.limits);
    EXPECT_EQ(decode.max_channels, 3);
    EXPECT_EQ(decode.max_values, 1000);
    EXPECT_EQ(decode.max_tile_bytes, 4096);
    EXPECT_EQ(result.config.limits.max_part_head_bytes, 1024u);
}

TEST(Config, OtherMachinesNeedKeysUnlessTheyAreLetInExpressly) {
    const auto outcome = [](const std::vector<const char*>& arguments) -> std::string {
        const auto [result, out, err] = read(arguments);
        EXPECT_FALSE(result.exit_status) << err;
        try {
            return check_who_may_reach_it(result.config);
        } catch (const std::runtime_error& error) {
            return std::string("refused: ") + error.what();
        }
    };
    EXPECT_EQ(outcome({}), "");
    for (const char* host : {"127.0.0.1", "127.8.9.10", "::1", "localhost"}) {
        EXPECT_EQ(outcome({"--host", host}), "") << host;
        EXPECT_EQ(outcome({"--host", host, "--insecure"}), "") << host;
    }
    for (const char* host : {"0.0.0.0", "::", "192.168.1.2", "10.127.0.1", "::ffff:127.0.0.1",
                             "example.org", "localhost.example.org", "127.0.0.1.example.org"}) {
        EXPECT_NE(outcome({"--host", host}).find("refused: --host"), std::string::npos) << host;
        EXPECT_NE(outcome({"--host", host, "--insecure"}).find("INSECURE"), std::string::npos);
        EXPECT_EQ(outcome({"--host", host, "--api-keys", "/etc/relit/keys"}), "") << host;
    }
    EXPECT_NE(outcome({"--insecure", "--api-keys=/etc/relit/keys"}).find("exclude each other"),
              std::string::npos);
    const Variable insecure("RELIT_INSECURE", "true");
    EXPECT_NE(outcome({"--host=::"}).find("INSECURE"), std::string::npos) << "as a variable";
}

TEST(Config, UnknownFlagsAndRefusedValuesExitWith2AndAReason) {
    for (const auto& arguments :
         std::vector<std::vector<const char*>>{{"--prot", "80"},
                                               {"stray"},
                                               {"--port", "70000"},
                                               {"--port", "x"},
                                               {"--max-queue", "-1"},
                                               {"--max-queue"},
                                               {"--log-level", "loud"},
                                               {"--log-format", "xml"},
                                               {"--log-slow", "-1"},
                                               {"--max-image-channels", "5"},
                                               {"--max-tile-bytes", "0"},
                                               {"--max-image-bytes", "much"},
                                               {"--max-storage", "0"},
                                               {"--cors-origins", "example.org"},
                                               {"--stop-timeout", "0"},
                                               {"--threads", "-1"},
                                               {"--min-bytes-per-second", "0"}}) {
        const auto [result, out, err] = read(arguments);
        EXPECT_EQ(result.exit_status, 2) << arguments.front();
        EXPECT_FALSE(err.empty());
    }
}

TEST(Config, OriginsAreReadAndRefusedByTheirFlag) {
    EXPECT_EQ(read({}).result.config.cors.allow, CorsPolicy::Allow::all);
    EXPECT_EQ(read({"--cors-origins", "none"}).result.config.cors.allow, CorsPolicy::Allow::none);
    const auto listed = read({"--cors-origins", "https://a.org,http://localhost:3000"});
    EXPECT_EQ(listed.result.config.cors.origins.size(), 2u);
    const auto refused = read({"--cors-origins", "https://a.org/,*"});
    EXPECT_EQ(refused.result.exit_status, 2);
    EXPECT_NE(refused.err.find("--cors-origins"), std::string::npos) << refused.err;
    EXPECT_NE(refused.err.find("'https://a.org/' is no origin"), std::string::npos) << refused.err;
}

TEST(Config, UnknownVariablesExitWith2AndTheirName) {
    const auto [result, out, err] = read({}, {"PATH=/bin", "RELIT_MAX_QEUE=7"});
    EXPECT_EQ(result.exit_status, 2);
    EXPECT_NE(err.find("RELIT_MAX_QEUE"), std::string::npos) << err;
    EXPECT_FALSE(read({}, {"RELIT_DATA=/data", "RELITD=1", "OTHER_RELIT_X=1"}).result.exit_status);
}

TEST(Config, HelpNamesEveryVariableAndDefault) {
    const auto [result, out, err] = read({"--help"});
    EXPECT_EQ(result.exit_status, 0);
    for (const char* text : {"--max-queue", "RELIT_MAX_QUEUE", "=64", "RELIT_DATA_DIR",
                             "RELIT_LOG_LEVEL", "--version"})
        EXPECT_NE(out.find(text), std::string::npos) << text;
}

TEST(Config, VersionIsPrinted) {
    const auto [result, out, err] = read({"--version"});
    EXPECT_EQ(result.exit_status, 0);
    EXPECT_TRUE(out.starts_with("relitd ")) << out;
}

TEST(Config, EverySettingIsListedWithItsValue) {
    const auto [result, out, err] = read({"--max-queue", "9"});
    const std::map<std::string, std::string> settings(result.config.settings.begin(),
                                                      result.config.settings.end());
    EXPECT_EQ(settings.at("max-queue"), "9");
    EXPECT_EQ(settings.at("host"), "127.0.0.1");
    EXPECT_EQ(settings.at("idle-timeout"), "20");
    EXPECT_GT(settings.size(), 20u);
    EXPECT_FALSE(settings.contains("help"));
}

TEST(Config, SimdIsOneThatTheProcessorHas) {
    EXPECT_EQ(read({}).result.config.simd, best_simd());
    EXPECT_EQ(read({"--simd=portable"}).result.config.simd, Simd::portable);
    const auto [result, out, err] = read({"--simd=mmx"});
    EXPECT_EQ(result.exit_status, 2);
    EXPECT_NE(err.find("'mmx' is none of what this processor has: portable"), std::string::npos)
        << err;
}

TEST(RendersAtOnce, IsOneForEveryTwoThreadsUnlessSet) {
    Config config;
    EXPECT_EQ(renders_at_once(config, 1), 1);
    EXPECT_EQ(renders_at_once(config, 8), 4);
    config.limits.max_renders = 3;
    EXPECT_EQ(renders_at_once(config, 8), 3);
    EXPECT_EQ(renders_at_once(config, 3), 3);
    EXPECT_THROW((void)renders_at_once(config, 2), std::runtime_error);
}

TEST(BatchSettings, AreReadAndRefusedWhereTheyCannotBe) {
    const auto [result, out, err] =
        read({"--batch-expiry=31536000", "--max-results=1GiB", "--batch-share=25"});
    ASSERT_FALSE(result.exit_status) << err;
    EXPECT_EQ(result.config.limits.batch_expiry, std::chrono::hours(24 * 365));
    EXPECT_EQ(result.config.limits.max_result_bytes, 1ull << 30);
    EXPECT_EQ(result.config.limits.batch_share, 25);
    for (const char* flag : {"--batch-share=0", "--batch-share=101", "--max-batch-frames=0",
                             "--max-results=0", "--batch-expiry=0", "--max-streams=-1"})
        EXPECT_EQ(read({flag}).result.exit_status, 2) << flag;
}

TEST(BatchSettings, StreamsLeaveConnectionsAndFramesHaveThreads) {
    Limits limits;
    EXPECT_EQ(limits.streams_at_once(), 204) << "80 % of 256";
    check_streams(limits);
    limits.max_streams = 255;
    check_streams(limits);
    EXPECT_EQ(limits.streams_at_once(), 255);
    limits.max_streams = 256;
    EXPECT_THROW(check_streams(limits), std::runtime_error);
    limits.max_batch_renders = 2;
    check_batch_renders(limits, 2);
    EXPECT_THROW(check_batch_renders(limits, 1), std::runtime_error);
}

}  // namespace
}  // namespace relit::server
