#include "server/http/trace_context.h"

#include <gtest/gtest.h>

#include <set>

namespace relit::server {
namespace {

const std::string trace_id = "4bf92f3577b34da6a3ce929d0e0e4736";
const std::string parent_id = "00f067aa0ba902b7";
const std::string good = "00-" + trace_id + "-" + parent_id + "-01";

// The recommendation's own examples.
TEST(TraceParent, IsReadAsTheRecommendationHasIt) {
    const auto trace = parse_traceparent(good);
    ASSERT_TRUE(trace);
    EXPECT_EQ(trace->trace_id, trace_id);
    EXPECT_EQ(trace->parent_id, parent_id);
    EXPECT_TRUE(trace->sampled);
    EXPECT_FALSE(parse_traceparent("00-" + trace_id + "-" + parent_id + "-00")->sampled);
    EXPECT_FALSE(parse_traceparent("00-" + trace_id + "-" + parent_id + "-fe")->sampled);
}

TEST(TraceParent, OfALaterVersionIsReadAsFarAsItIsKnown) {
    for (const char* more : {"", "-", "-what-comes-then"})
        EXPECT_TRUE(parse_traceparent("cc" + good.substr(2) + more)) << more;
    EXPECT_FALSE(parse_traceparent("cc" + good.substr(2) + "x"));
    EXPECT_FALSE(parse_traceparent("cc" + good.substr(2) + ", " + good)) << "two headers";
    EXPECT_FALSE(parse_traceparent("ff" + good.substr(2)));
}

TEST(TraceParent, ThatIsNotValidIsNone) {
    EXPECT_FALSE(parse_traceparent("00-" + std::string(32, '0') + "-" + parent_id + "-01"));
    EXPECT_FALSE(parse_traceparent("00-" + trace_id + "-" + std::string(16, '0') + "-01"));
    EXPECT_FALSE(parse_traceparent(good + "-"));
    EXPECT_FALSE(parse_traceparent(good + " "));
    EXPECT_FALSE(parse_traceparent(" " + good));
    EXPECT_FALSE(parse_traceparent(good + ", " + good)) << "two headers";
    for (std::size_t size = 0; size < good.size(); ++size)
        EXPECT_FALSE(parse_traceparent(good.substr(0, size))) << size;
    for (std::size_t at = 0; at < good.size(); ++at)
        for (const char c : {'g', 'A', '-', ' ', '\0', '\xff'}) {
            std::string bad = good;
            if (bad[at] == c) continue;
            bad[at] = c;
            EXPECT_FALSE(parse_traceparent(bad)) << bad;
        }
}

TEST(TraceOfRequest, GoesOnWithTheCallersOrBegins) {
    const auto child = trace_of_request(good);
    EXPECT_EQ(child.trace_id, trace_id);
    EXPECT_EQ(child.parent_id, parent_id);
    EXPECT_NE(child.span_id, parent_id);
    EXPECT_EQ(traceparent_text(child), "00-" + trace_id + "-" + child.span_id + "-01");
    std::set<std::string> traces, spans;
    for (int i = 0; i < 1000; ++i) {
        const auto trace =
            trace_of_request(i % 2 ? std::optional<std::string_view>("broken") : std::nullopt);
        EXPECT_TRUE(parse_traceparent(traceparent_text(trace))) << "one that others accept";
        EXPECT_EQ(trace.parent_id, "");
        EXPECT_FALSE(trace.sampled);
        traces.insert(trace.trace_id);
        spans.insert(trace.span_id);
    }
    EXPECT_EQ(traces.size(), 1000u);
    EXPECT_EQ(spans.size(), 1000u);
}

}  // namespace
}  // namespace relit::server
