#include "server/jobs/render_slots.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <thread>
#include <vector>

#include "server/error_codes.h"

namespace relit::server {
namespace {

using namespace std::chrono_literals;
using Clock = RenderSlots::Clock;
constexpr auto never = Clock::time_point::max();

void wait_until(const auto& condition) {
    while (!condition()) std::this_thread::sleep_for(1ms);
}

// A caller on a thread of its own: what it got, and when it may give it back.
class Caller {
public:
    Caller(RenderSlots& slots, Clock::time_point deadline, std::function<void()> got = {})
        : thread_([this, &slots, deadline, got = std::move(got)] {
              try {
                  const auto slot = slots.wait_for_slot(deadline, stop_.get_token());
                  if (got) got();
                  has_slot_ = true;
                  wait_until([this] { return done_.load(); });
              } catch (const Error& error) {
                  code_ = error.code;
              }
              over_ = true;
          }) {}
    ~Caller() {
        done_ = true;
        stop_.request_stop();
        thread_.join();
    }
    void give_back() { done_ = true; }
    void cancel() { stop_.request_stop(); }
    [[nodiscard]] bool has_slot() const { return has_slot_; }
    [[nodiscard]] std::string_view refusal() const {
        wait_until([this] { return over_.load(); });
        return code_;
    }

private:
    std::stop_source stop_;
    std::atomic<bool> done_{false}, has_slot_{false}, over_{false};
    std::string_view code_;
    std::thread thread_;
};

std::string refusal_of(RenderSlots& slots, Clock::time_point deadline = never,
                       const std::stop_token& stop = {}) {
    try {
        (void)slots.wait_for_slot(deadline, stop);
        return "slot";
    } catch (const Error& error) {
        return std::string(error.code);
    }
}

TEST(RenderSlots, AreGivenAtOnceWhileThereAreAny) {
    RenderSlots slots({.max_running = 2, .max_waiting = 0});
    const auto first = slots.wait_for_slot(never, {});
    {
        const auto second = slots.wait_for_slot(never, {});
        EXPECT_EQ(slots.running(), 2);
        EXPECT_EQ(refusal_of(slots), "queue-full");
    }
    EXPECT_EQ(refusal_of(slots), "slot") << "given back by the destructor";
}

TEST(RenderSlots, FullQueueNamesItsSetting) {
    RenderSlots slots({.max_running = 1, .max_waiting = 0});
    const auto slot = slots.wait_for_slot(never, {});
    try {
        (void)slots.wait_for_slot(never, {});
        FAIL();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("max-queue"), std::string::npos) << error.what();
    }
}

TEST(RenderSlots, GoToTheLongestWaitingFirst) {
    RenderSlots slots({.max_running = 1, .max_waiting = 20});
    std::vector<int> order;
    std::vector<std::unique_ptr<Caller>> callers;
    auto held = std::optional(slots.wait_for_slot(never, {}));
    for (int i = 0; i < 20; ++i) {
        callers.push_back(
            std::make_unique<Caller>(slots, never, [&order, i] { order.push_back(i); }));
        wait_until([&] { return slots.waiting() == i + 1; });
        callers.back()->give_back();
    }
    held.reset();
    for (const auto& caller : callers) EXPECT_EQ(caller->refusal(), "");
    for (int i = 0; i < 20; ++i) EXPECT_EQ(order.at(std::size_t(i)), i);
    EXPECT_EQ(slots.running(), 0);
}

// Two newcomers ask all the time; without a queue of tickets one of them would slip in before the
// waiter.
TEST(RenderSlots, NewcomersNeverPassAWaiter) {
    RenderSlots slots({.max_running = 1, .max_waiting = 3});
    std::atomic<bool> stop{false};
    std::vector<std::thread> newcomers;
    newcomers.reserve(2);
    for (int i = 0; i < 2; ++i)
        newcomers.emplace_back([&] {
            while (!stop) {
                const auto slot = slots.wait_for_slot(never, {});
                std::this_thread::sleep_for(200us);
            }
        });
    for (int i = 0; i < 50; ++i) {
        const auto slot = slots.wait_for_slot(never, {});
        EXPECT_LT(slot.waited(), 2s);
    }
    stop = true;
    for (auto& newcomer : newcomers) newcomer.join();
}

TEST(RenderSlots, DeadlineEndsTheWait) {
    std::atomic<Clock::time_point> time{Clock::time_point{} + 1h};
    RenderSlots slots({.max_running = 1, .max_waiting = 5}, [&] { return time.load(); });
    const auto held = slots.wait_for_slot(never, {});
    EXPECT_EQ(refusal_of(slots, time), "timed-out") << "a deadline that has come already";

    Caller early(slots, time.load() + 10s);
    wait_until([&] { return slots.waiting() == 1; });
    Caller late(slots, time.load() + 20s);
    wait_until([&] { return slots.waiting() == 2; });
    time = time.load() + 9s;
    slots.recheck();
    std::this_thread::sleep_for(20ms);
    EXPECT_EQ(slots.waiting(), 2);
    time = time.load() + 1s;
    slots.recheck();
    EXPECT_EQ(early.refusal(), "timed-out");
    EXPECT_EQ(slots.waiting(), 1) << "the later deadline still waits";
}

TEST(RenderSlots, DeadlineEndsTheWaitByTheRealClockToo) {
    RenderSlots slots({.max_running = 1, .max_waiting = 5});
    const auto held = slots.wait_for_slot(never, {});
    const auto start = Clock::now();
    EXPECT_EQ(refusal_of(slots, start + 50ms), "timed-out");
    EXPECT_GE(Clock::now() - start, 50ms);
    EXPECT_EQ(slots.waiting(), 0);
}

TEST(RenderSlots, CancelledWaitersLeaveTheLine) {
    RenderSlots slots({.max_running = 1, .max_waiting = 2});
    auto held = std::optional(slots.wait_for_slot(never, {}));
    Caller first(slots, never);
    wait_until([&] { return slots.waiting() == 1; });
    Caller second(slots, never);
    wait_until([&] { return slots.waiting() == 2; });
    first.cancel();
    EXPECT_EQ(first.refusal(), "cancelled");
    EXPECT_EQ(slots.waiting(), 1) << "its place is free again";
    held.reset();
    wait_until([&] { return second.has_slot(); });

    std::stop_source stopped;
    stopped.request_stop();
    EXPECT_EQ(refusal_of(slots, never, stopped.get_token()), "cancelled");
}

// Grants, deadlines and cancellations at the same moments: no slot is lost, none is given twice.
TEST(RenderSlots, AreNeitherLostNorGivenTwice) {
    RenderSlots slots({.max_running = 2, .max_waiting = 8});
    std::atomic<int> running{0}, most{0}, got{0};
    std::vector<std::thread> callers;
    callers.reserve(8);
    for (int i = 0; i < 8; ++i)
        callers.emplace_back([&, i] {
            for (int k = 0; k < 200; ++k) {
                std::stop_source stop;
                const std::jthread canceller([&] {
                    if (k % 3 == 0) stop.request_stop();
                });
                try {
                    const auto slot = slots.wait_for_slot(
                        Clock::now() + std::chrono::microseconds(50 * (i + k % 7)),
                        stop.get_token());
                    most = std::max(most.load(), ++running);
                    ++got;
                    --running;
                } catch (const Error&) {
                }
            }
        });
    for (auto& caller : callers) caller.join();
    EXPECT_LE(most, 2);
    EXPECT_GT(got, 0);
    EXPECT_EQ(slots.running(), 0);
    EXPECT_EQ(slots.waiting(), 0);
}

}  // namespace
}  // namespace relit::server
