#include "core/base/shared_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace relit::test {
namespace {

using Made = SharedCache::Made<int>;

// An int of that many bytes, counting how often it is made.
class Maker {
public:
    Maker(int value, std::uint64_t bytes) : value_(value), bytes_(bytes) {}
    Made operator()() const {
        ++count_;
        return {std::make_shared<const int>(value_), bytes_};
    }
    [[nodiscard]] int count() const { return count_; }

private:
    int value_;
    std::uint64_t bytes_;
    mutable std::atomic<int> count_{0};
};

TEST(SharedCache, MakesAThingOnceAndGivesEverybodyTheSame) {
    SharedCache cache(100);
    const Maker seven(7, 10);
    const auto first = cache.get<int>("a", seven);
    const auto second = cache.get<int>("a", seven);
    EXPECT_EQ(*first, 7);
    EXPECT_EQ(first, second);
    EXPECT_EQ(seven.count(), 1);
    EXPECT_EQ(cache.bytes(), 10u);
    EXPECT_EQ(cache.hits(), 1u);
    EXPECT_EQ(cache.misses(), 1u);
}

TEST(SharedCache, DropsWhatWasNotAskedForTheLongest) {
    SharedCache cache(30);
    const Maker a(1, 10), b(2, 10), c(3, 10), d(4, 20);
    const auto kept = cache.get<int>("a", a);
    (void)cache.get<int>("b", b);
    (void)cache.get<int>("c", c);
    (void)cache.get<int>("a", a);
    (void)cache.get<int>("d", d);  // in place of b and c
    EXPECT_EQ(cache.bytes(), 30u);
    (void)cache.get<int>("a", a);
    EXPECT_EQ(a.count(), 1);
    (void)cache.get<int>("b", b);
    EXPECT_EQ(b.count(), 2);
    EXPECT_EQ(*kept, 1) << "who has a thing keeps it";
}

TEST(SharedCache, WhatExceedsTheBudgetAloneIsGivenAndNotKept) {
    SharedCache cache(30);
    const Maker small(1, 30), large(2, 31);
    (void)cache.get<int>("small", small);
    EXPECT_EQ(*cache.get<int>("large", large), 2);
    EXPECT_EQ(*cache.get<int>("large", large), 2);
    EXPECT_EQ(large.count(), 2);
    (void)cache.get<int>("small", small);
    EXPECT_EQ(small.count(), 1);
}

TEST(SharedCache, TenThatAskAtOnceHaveItMadeOnce) {
    SharedCache cache(100);
    std::atomic<int> made{0};
    std::vector<std::thread> threads;
    for (int k = 0; k < 10; ++k)
        threads.emplace_back([&] {
            const auto thing = cache.get<int>("slow", [&] {
                ++made;
                std::this_thread::sleep_for(std::chrono::milliseconds(50));
                return Made{std::make_shared<const int>(5), 1};
            });
            EXPECT_EQ(*thing, 5);
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(made, 1);
    EXPECT_EQ(cache.hits(), 9u);
}

TEST(SharedCache, AFailureIsItsMakersAloneAndTheNextOneTries) {
    SharedCache cache(100);
    std::atomic<int> tries{0};
    std::atomic<int> failures{0};
    std::vector<std::thread> threads;
    for (int k = 0; k < 4; ++k)
        threads.emplace_back([&] {
            try {
                (void)cache.get<int>("a", [&]() -> Made {
                    std::this_thread::sleep_for(std::chrono::milliseconds(20));
                    if (++tries <= 2) throw std::runtime_error("broken");
                    return {std::make_shared<const int>(5), 1};
                });
            } catch (const std::runtime_error&) {
                ++failures;
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(failures, 2);
    EXPECT_EQ(tries, 3);
    EXPECT_EQ(cache.bytes(), 1u);
}

TEST(SharedCache, ABudgetOfNothingKeepsNothing) {
    SharedCache cache(0);
    const Maker a(1, 1);
    EXPECT_EQ(*cache.get<int>("a", a), 1);
    EXPECT_EQ(*cache.get<int>("a", a), 1);
    EXPECT_EQ(a.count(), 2);
    EXPECT_EQ(cache.bytes(), 0u);
}

}  // namespace
}  // namespace relit::test
