#include "server/http/refusal_log.h"

#include <gtest/gtest.h>

namespace relit::server {
namespace {

TEST(RefusalLog, TellsOfEachReasonAtOnceThenOfAllSinceAtMostOnceInAPause) {
    const RefusalLog::Clock::time_point start{RefusalLog::pause};
    RefusalLog log;
    EXPECT_EQ(log.count("a", start), 1u);
    EXPECT_EQ(log.count("b", start), 1u);
    for (int i = 1; i < 10; ++i) EXPECT_EQ(log.count("a", start + std::chrono::seconds(i)), 0u);
    EXPECT_EQ(log.count("a", start + RefusalLog::pause), 10u);
    EXPECT_EQ(log.count("a", start + RefusalLog::pause), 0u);
    EXPECT_EQ(log.count("b", start + 5 * RefusalLog::pause), 1u);
}

}  // namespace
}  // namespace relit::server
