#include "server/access/rate_limit.h"

#include <gtest/gtest.h>

namespace relit::server {
namespace {

using namespace std::chrono_literals;

struct FakeClock {
    RateLimit::Clock::time_point now = RateLimit::Clock::time_point(1000s);
    auto function() {
        return [this] { return now; };
    }
};

TEST(RateLimit, LetsABurstThroughAndThenTheRate) {
    FakeClock clock;
    RateLimit limit(10, 5, clock.function());
    for (int left = 4; left >= 0; --left) {
        const RateState state = limit.take("a");
        EXPECT_TRUE(state.allowed);
        EXPECT_EQ(state.remaining, left);
    }
    for (int i = 0; i < 100; ++i) EXPECT_FALSE(limit.take("a").allowed) << "asking costs nothing";
    int allowed = 0;
    for (int i = 0; i < 1000; ++i) {
        clock.now += 10ms;
        allowed += limit.take("a").allowed;
    }
    EXPECT_EQ(allowed, 100) << "10 s at 10 a second";
    clock.now += 1h;
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(limit.take("a").allowed);
    EXPECT_FALSE(limit.take("a").allowed) << "a pause saves up no more than the burst";
}

TEST(RateLimit, SaysWhenToComeBack) {
    FakeClock clock;
    RateLimit limit(0.1, 2, clock.function());
    EXPECT_EQ(limit.take("a").reset_s, 10);
    const RateState last = limit.take("a");
    EXPECT_EQ(last.reset_s, 20);
    EXPECT_EQ(last.limit, 2);
    EXPECT_EQ(last.retry_after_s, 0);
    EXPECT_EQ(limit.take("a").retry_after_s, 10);
    clock.now += 9s;
    EXPECT_EQ(limit.take("a").retry_after_s, 1);
    clock.now += 1s;
    EXPECT_TRUE(limit.take("a").allowed) << "who waits as long as told is let in";
}

TEST(RateLimit, ClientsHaveBucketsOfTheirOwn) {
    FakeClock clock;
    RateLimit limit(1, 1, clock.function());
    EXPECT_TRUE(limit.take("a").allowed);
    EXPECT_FALSE(limit.take("a").allowed);
    EXPECT_TRUE(limit.take("b").allowed);
}

TEST(RateLimit, AnyNumberOfClientsTakesBoundedMemory) {
    FakeClock clock;
    RateLimit limit(1, 2, clock.function());
    for (int i = 0; i < 300'000; ++i) (void)limit.take(std::to_string(i));
    EXPECT_EQ(limit.buckets(), 100'000u);
    EXPECT_FALSE(limit.take("one more").allowed) << "the rest share a bucket";
    EXPECT_TRUE(limit.take("7").allowed) << "who had one keeps it";
    clock.now += 10s;
    EXPECT_TRUE(limit.take("one more").allowed);
    EXPECT_LT(limit.buckets(), 10u) << "full buckets are forgotten";
}

}  // namespace
}  // namespace relit::server
