#include "server/jobs/render_slots.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "server/error_codes.h"

namespace relit::server {
namespace {

using namespace std::chrono_literals;
using Clock = RenderSlots::Clock;
constexpr auto never = Clock::time_point::max();

void wait_until(const auto& condition) {
    const auto start = Clock::now();
    while (!condition()) {
        if (Clock::now() - start > 20s) throw std::runtime_error("waited in vain");
        std::this_thread::sleep_for(1ms);
    }
}

// A caller on a thread of its own: what it got, and when it may give it back.
class Caller {
public:
    Caller(RenderSlots& slots, Clock::time_point deadline, std::function<void()> got = {},
           std::string session = {})
        : thread_([this, &slots, deadline, got = std::move(got), session = std::move(session)] {
              try {
                  const auto slot = slots.wait_for_slot(deadline, stop_.get_token(), session);
                  if (got) got();
                  has_slot_ = true;
                  const auto superseded = slot.stop_token();
                  wait_until([&] { return done_.load() || superseded.stop_requested(); });
                  if (superseded.stop_requested()) code_ = "stopped";
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

class Sessions : public testing::Test {
protected:
    // Asks for a slot, and gives it back as soon as it has it.
    Caller& ask(const std::string& name, const std::string& session) {
        callers_.push_back(std::make_unique<Caller>(
            slots_, never, [this, name] { order_ += name; }, session));
        callers_.back()->give_back();
        return *callers_.back();
    }
    // The same while nobody gives a slot back: it is the last of `waiting`.
    Caller& join(const std::string& name, const std::string& session, int waiting) {
        Caller& caller = ask(name, session);
        wait_until([&] { return slots_.waiting() == waiting; });
        return caller;
    }
    void wait_for_all() {
        for (const auto& caller : callers_) (void)caller->refusal();
    }

    RenderSlots slots_{{.max_running = 1, .max_waiting = 4}};
    std::string order_;  // written by one slot's owner at a time
    std::vector<std::unique_ptr<Caller>> callers_;
};

TEST_F(Sessions, NewerRequestTakesThePlaceOfItsWaitingOne) {
    auto held = std::optional(slots_.wait_for_slot(never, {}));
    const Caller& first = join("1", "drag", 1);
    join("2", "", 2);
    join("3", "other", 3);
    const Caller newer(
        slots_, never, [this] { order_ += "4"; }, "drag");
    EXPECT_EQ(first.refusal(), "superseded");
    EXPECT_EQ(slots_.waiting(), 3);
    EXPECT_FALSE(held->stop_token().stop_requested()) << "not of the session";
    held.reset();
    wait_until([&] { return newer.has_slot(); });
    EXPECT_EQ(order_, "4") << "where the first was, not at the end";
}

TEST_F(Sessions, NewerRequestStopsItsRunningOneAndGoesToTheEnd) {
    Caller running(slots_, never, {}, "drag");
    wait_until([&] { return running.has_slot(); });
    join("1", "", 1);
    ask("2", "drag");
    EXPECT_EQ(running.refusal(), "stopped");
    wait_for_all();
    EXPECT_EQ(order_, "12");
    EXPECT_EQ(slots_.running() + slots_.waiting(), 0);
}

TEST_F(Sessions, OrderOfArrivalDecidesAmongMany) {
    auto held = std::optional(slots_.wait_for_slot(never, {}));
    const Caller* older = &join("0", "drag", 1);
    for (int i = 1; i < 30; ++i) {
        const Caller& newer = ask(std::to_string(i), "drag");
        EXPECT_EQ(older->refusal(), "superseded") << i;
        EXPECT_EQ(slots_.waiting(), 1);
        older = &newer;
    }
    held.reset();
    wait_for_all();
    EXPECT_EQ(order_, "29");
}

TEST_F(Sessions, FullQueueHasRoomForWhoSupersedesAndForNobodyElse) {
    Caller running(slots_, never, {}, "running");
    wait_until([&] { return running.has_slot(); });
    for (int i = 0; i < 4; ++i) join("x", "s" + std::to_string(i), i + 1);
    EXPECT_EQ(refusal_of(slots_), "queue-full");
    Caller newer(slots_, never, {}, "s2");
    newer.give_back();
    EXPECT_EQ(callers_[2]->refusal(), "superseded");
    EXPECT_EQ(slots_.waiting(), 4);
    EXPECT_TRUE(running.has_slot()) << "nobody of its session has come";
    const Caller next(slots_, never, {}, "running");
    EXPECT_EQ(running.refusal(), "stopped");
    wait_for_all();
    wait_until([&] { return next.has_slot(); });
    EXPECT_EQ(order_, "xxx") << "who waited longer went first";
}

TEST_F(Sessions, DeadlineOfTheNewerRequestIsItsOwn) {
    std::atomic<Clock::time_point> time{Clock::time_point{} + 1h};
    RenderSlots slots({.max_running = 1, .max_waiting = 5}, [&] { return time.load(); });
    const auto held = slots.wait_for_slot(never, {});
    const Caller older(slots, time.load() + 10s, {}, "drag");
    wait_until([&] { return slots.waiting() == 1; });
    time = time.load() + 9s;
    const Caller newer(slots, time.load() + 10s, {}, "drag");
    EXPECT_EQ(older.refusal(), "superseded");
    time = time.load() + 9s;
    slots.recheck();
    std::this_thread::sleep_for(20ms);
    EXPECT_EQ(slots.waiting(), 1) << "the older one's deadline went with it";
    time = time.load() + 1s;
    slots.recheck();
    EXPECT_EQ(newer.refusal(), "timed-out");
}

TEST_F(Sessions, CanBeSupersededWithoutASlot) {
    Caller running(slots_, never, {}, "drag");
    wait_until([&] { return running.has_slot(); });
    const Caller& other = join("1", "other", 1);
    slots_.supersede("other");
    EXPECT_EQ(other.refusal(), "superseded");
    slots_.supersede("");
    slots_.supersede("never heard of");
    EXPECT_EQ(slots_.running(), 1);
    slots_.supersede("drag");
    EXPECT_EQ(running.refusal(), "stopped");
}

// One session asks far more often than it can be served; the others get their turns.
TEST_F(Sessions, EagerOneStarvesNobody) {
    std::atomic<bool> stop{false};
    std::vector<std::thread> eager;
    eager.reserve(3);
    for (int i = 0; i < 3; ++i)
        eager.emplace_back([&] {
            while (!stop) try {
                    const auto slot = slots_.wait_for_slot(never, {}, "eager");
                    std::this_thread::sleep_for(100us);
                } catch (const Error& error) {
                    EXPECT_EQ(error.code, error_code::superseded);
                }
        });
    for (int i = 0; i < 100; ++i) {
        const auto slot = slots_.wait_for_slot(never, {}, "calm");
        EXPECT_LT(slot.waited(), 1s);
    }
    stop = true;
    for (auto& thread : eager) thread.join();
    EXPECT_EQ(slots_.running() + slots_.waiting(), 0);
}

// Grants, deadlines, cancellations and newer requests at the same moments: no slot is lost, none is given twice.
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
                        stop.get_token(),
                        k % 2 == 0 ? ""
                        : i < 4    ? "drag"
                                   : "other");
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

// With a clock of its own, one slot and three places in line.
class Line : public testing::Test {
protected:
    void wait_in_line(int callers) {
        for (int i = 0; i < callers; ++i) {
            waiting_.push_back(std::make_unique<Caller>(slots_, never));
            wait_until([&] { return slots_.waiting() == int(waiting_.size()); });
        }
    }
    void leave_line() { waiting_.clear(); }

    std::atomic<Clock::time_point> now_ = Clock::time_point(1000s);
    RenderSlots slots_{{.max_running = 1, .max_waiting = 3}, [this] { return now_.load(); }};
    std::vector<std::unique_ptr<Caller>> waiting_;
};

TEST_F(Line, ThatHasBeenFullIsKeptShortUntilSlotsAreFree) {
    std::optional<RenderSlots::Slot> held;
    const auto hold = [&] { held.emplace(slots_.wait_for_slot(never, {})); };
    hold();
    wait_in_line(3);
    EXPECT_FALSE(slots_.overloaded()) << "a burst";
    EXPECT_EQ(refusal_of(slots_), "queue-full");
    EXPECT_TRUE(slots_.overloaded());
    leave_line();
    wait_in_line(1);
    EXPECT_EQ(refusal_of(slots_), "queue-full") << "two more could wait";
    leave_line();

    // A second in which the slot was free for less than a fifth of it changes nothing.
    now_ = now_.load() + 850ms;
    held.reset();
    now_ = now_.load() + 150ms;
    hold();
    EXPECT_TRUE(slots_.overloaded());
    now_ = now_.load() + 700ms;
    held.reset();
    now_ = now_.load() + 300ms;
    hold();
    EXPECT_FALSE(slots_.overloaded());
    wait_in_line(3);
    EXPECT_EQ(refusal_of(slots_), "queue-full");
    leave_line();
}

TEST_F(Line, TakesNobodyWhoseTurnWouldComeTooLate) {
    auto held = std::optional(slots_.wait_for_slot(never, {}));
    now_ = now_.load() + 10s;
    held.reset();  // work takes 10 s
    held.emplace(slots_.wait_for_slot(never, {}));
    wait_in_line(2);
    try {
        (void)slots_.wait_for_slot(now_.load() + 19s, {});
        FAIL() << "two are before it";
    } catch (const Error& error) {
        EXPECT_EQ(error.code, error_code::queue_full);
        EXPECT_EQ(error.limit, "render-timeout");
    }
    EXPECT_FALSE(slots_.overloaded());
    Caller patient(slots_, now_.load() + 21s);
    wait_until([&] { return slots_.waiting() == 3; });
    leave_line();
    patient.cancel();
    EXPECT_EQ(patient.refusal(), "cancelled");
}

TEST(RenderSlots, TellHowLongNobodyHasUsedThem) {
    auto now = Clock::time_point(1h);
    RenderSlots slots({.max_running = 1}, [&] { return now; });
    EXPECT_EQ(slots.idle_for(), Clock::duration::max()) << "nobody ever";
    {
        const auto slot = slots.wait_for_slot(never, {});
        now += 5s;
        EXPECT_EQ(slots.idle_for(), 0s);
    }
    EXPECT_EQ(slots.idle_for(), 0s);
    now += 3s;
    EXPECT_EQ(slots.idle_for(), 3s);
}

}  // namespace
}  // namespace relit::server
