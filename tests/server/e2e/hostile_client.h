// For the tests of hostile clients: the real program, with its memory watched at its highest.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <memory>
#include <string>

#include "tests/support/http_client.h"
#include "tests/support/processes.h"
#include "tests/support/relit_process.h"

namespace relit::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

/// One server for all tests of a suite. After each of them it is well, and in between its memory has
/// never been more than a little above what it was.
class HostileClient : public testing::Test {
protected:
    static void SetUpTestSuite() {
        relitd = std::make_unique<RelitProcess>();
        ASSERT_GT(relitd->port(), 0) << relitd->log();
    }
    static void TearDownTestSuite() { relitd.reset(); }

    void SetUp() override {
        std::ofstream("/proc/" + std::to_string(relitd->pid()) + "/clear_refs") << 5;  // VmHWM
        before_mib_ = std::stol(status_of(relitd->pid(), "VmRSS")) / 1024;
    }
    void TearDown() override {
        EXPECT_EQ(http(relitd->port(), "GET", "/healthz").status, 200) << relitd->log();
        const long grown_mib = relitd->peak_memory_mib() - before_mib_;
        RecordProperty("grown_mib", int(grown_mib));
        if (!sanitized) {
            EXPECT_LT(grown_mib, allowed_mib);
        }
    }

    [[nodiscard]] static HttpReply send(const std::string& method, const std::string& target,
                                        const std::string& body = {},
                                        const HttpHeaders& headers = {}) {
        return http(relitd->port(), method, target, body, headers);
    }
    /// Refused as the client's fault, in its own words and nobody else's.
    static void expect_refused(const HttpReply& reply, int status, const std::string& says) {
        EXPECT_EQ(reply.status, status) << reply.body.substr(0, 500);
        EXPECT_EQ(reply.header("content-type"), "application/problem+json");
        EXPECT_NE(reply.body.find(says), std::string::npos) << reply.body.substr(0, 500);
        EXPECT_EQ(reply.body.find(relitd->data_dir().string()), std::string::npos) << reply.body;
    }

    static inline std::unique_ptr<RelitProcess> relitd;
    long allowed_mib = 16;  ///< beyond the memory before; a test that sends much allows more

private:
    long before_mib_ = 0;
};

}  // namespace relit::test
