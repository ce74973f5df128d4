#include "server/routes/meta.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "server/error_codes.h"
#include "server/http/problem.h"
#include "tests/support/metrics_text.h"
#include "tests/support/test_server.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

std::string_view refusal_of_readiness(server::Services& services) {
    try {
        (void)server::get_readiness({}, services);
        return "ready";
    } catch (const Error& error) {
        EXPECT_EQ(server::problem_kind(error.code).status, 503);
        return error.code;
    }
}

TEST(Readiness, NeedsAServerThatGoesOnAndADataFolder) {
    TestServices services;
    EXPECT_EQ(server::get_readiness({}, services.services).body, R"({"status":"ready"})");
    const auto folder = services.services.data_dir;
    std::filesystem::rename(folder, folder.string() + ".moved");
    EXPECT_EQ(refusal_of_readiness(services.services), error_code::not_ready);
    std::filesystem::rename(folder.string() + ".moved", folder);
    EXPECT_EQ(refusal_of_readiness(services.services), "ready");
    services.services.draining = true;
    EXPECT_EQ(refusal_of_readiness(services.services), error_code::shutting_down);
}

TEST(MetricsRoute, SaysWhatServicesAndProcessDo) {
    TestServices services;
    const auto slot =
        services.renders.wait_for_slot(std::chrono::steady_clock::time_point::max(), {});
    const std::string png = small_png();
    services.images.put(png, decode(png).info);
    const server::Reply reply = server::get_metrics({}, services.services);
    EXPECT_EQ(reply.content_type, "text/plain; version=0.0.4; charset=utf-8");
    const auto samples = parse_metrics(reply.body);
    EXPECT_EQ(samples.at("relit_renders_running"), 1);
    EXPECT_EQ(samples.at("relit_renders_waiting"), 0);
    EXPECT_EQ(samples.at("relit_decodes_running"), 0);
    EXPECT_EQ(samples.at("relit_stored_images"), 1);
    EXPECT_EQ(samples.at("relit_stored_bytes"), double(png.size()));
    EXPECT_EQ(samples.at("relit_evicted_images_total"), 0);
    EXPECT_EQ(samples.at("relit_build_info{version=\"" + std::string(server::version()) + "\"}"),
              1);
    EXPECT_GT(samples.at("process_cpu_seconds_total"), 0);
    EXPECT_GT(samples.at("process_resident_memory_bytes"), 1e6);
    EXPECT_GE(samples.at("process_virtual_memory_bytes"),
              samples.at("process_resident_memory_bytes"));
    EXPECT_GE(samples.at("process_open_fds"), 3);
    EXPECT_GE(samples.at("process_max_fds"), samples.at("process_open_fds"));
    const double now = double(std::time(nullptr));
    EXPECT_NEAR(samples.at("process_start_time_seconds"), now, 3600);
}

}  // namespace
}  // namespace relit::test
