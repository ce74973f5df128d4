// Batches through their handlers, rendered by real workers.
#include "server/routes/batches.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "server/error_codes.h"
#include "server/routes/render.h"
#include "tests/support/test_server.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;
using server::Reply;
using server::Request;

class BatchRoutes : public testing::Test {
protected:
    BatchRoutes() {
        const std::string png = small_png(1, 32, 24);
        image = services.images.put(png, decode(png).info).id;
    }

    static Request request_of(const std::string& method, const std::string& body = {}) {
        Request request;
        request.method = method;
        request.body = body;
        return request;
    }
    static Request about(const std::string& id, const std::string& n = {}) {
        Request request = request_of("GET");
        request.path_params = {{"id", id}, {"n", n}};
        return request;
    }
    [[nodiscard]] std::string scene(const std::string& rest = {}) const {
        return R"({"height": {"image": ")" + image + "\"}" + rest + "}";
    }
    [[nodiscard]] std::string orbit(int count) const {
        return "{\"scene\": " + scene() + R"(, "sweep": {"path": "orbit", "count": )" +
               std::to_string(count) + "}}";
    }
    Reply post(const std::string& body, const std::string& key = {}) {
        Request request = request_of("POST", body);
        if (!key.empty()) request.headers["Idempotency-Key"] = key;
        return submit_batch(request, services.services);
    }
    std::string submitted(const std::string& body) { return Json::parse(post(body).body)["id"]; }
    Json status_of(const std::string& id) {
        return Json::parse(get_batch(about(id), services.services).body);
    }
    Json finished(const std::string& id) {
        for (int i = 0; i < 1000; ++i) {
            Json batch = status_of(id);
            if (batch["status"] == "done") return batch;
            std::this_thread::sleep_for(5ms);
        }
        ADD_FAILURE() << "not finished";
        return {};
    }
    static std::string text_of(const Reply& reply) {
        std::string text;
        EXPECT_TRUE(reply.stream->send([&](std::string_view piece) {
            text += piece;
            return true;
        }));
        return text;
    }
    template <class Call>
    std::string refusal_of(const Call& call) {
        try {
            (void)call();
            return "none";
        } catch (const Error& error) {
            return std::string(error.code) + " " + error.pointer;
        }
    }

    TestServices services;
    std::string image;
};

TEST_F(BatchRoutes, ASubmissionIsAcceptedAndFoundAgain) {
    const Reply reply = post(orbit(3));
    EXPECT_EQ(reply.status, 202);
    const Json answer = Json::parse(reply.body);
    const std::string id = answer["id"];
    EXPECT_EQ(reply.headers.at("Location"), "/v1/batches/" + id);
    EXPECT_EQ(answer,
              Json({{"id", id}, {"status", "queued"}, {"total", 3}, {"done", 0}, {"failed", 0}}));
    const Json batch = status_of(id);
    EXPECT_EQ(batch["status"], "queued");
    EXPECT_EQ(batch["started"], nullptr);
    EXPECT_EQ(batch["problems"], Json::array());
    EXPECT_EQ(refusal_of([&] { return get_batch(about("no"), services.services); }), "not-found ");
}

TEST_F(BatchRoutes, FramesHaveTheBytesThatARenderOfTheirSceneHas) {
    services.batches.start();
    const std::string id =
        submitted("{\"scene\": " + scene(R"(, "preset": "bronze")") +
                  R"(, "frames": [{}, {"relief": 0.3, "output": {"format": "jpeg"}}]})");
    const Json batch = finished(id);
    EXPECT_EQ(batch["done"], 2);
    EXPECT_GT(batch["bytes"], 100);
    const Reply frame = get_batch_frame(about(id, "1"), services.services);
    EXPECT_EQ(frame.content_type, "image/jpeg");
    EXPECT_EQ(frame.headers.at("Content-Disposition"), "inline; filename=\"0001.jpg\"");
    const Reply render = render_picture(
        request_of("POST",
                   scene(R"(, "preset": "bronze", "relief": 0.3, "output": {"format": "jpeg"})")),
        services.services);
    EXPECT_EQ(frame.bytes(), render.bytes());
    Request again = about(id, "1");
    again.headers["If-None-Match"] = frame.headers.at("ETag");
    EXPECT_EQ(get_batch_frame(again, services.services).status, 304);
    for (const char* number : {"2", "-1", "x", ""})
        EXPECT_EQ(refusal_of([&] { return get_batch_frame(about(id, number), services.services); }),
                  "not-found ");
}

TEST_F(BatchRoutes, TheSameKeyAndBodyIsOneBatch) {
    const Reply first = post(orbit(2), "k");
    EXPECT_EQ(post(orbit(2), "k").body, first.body);
    EXPECT_EQ(refusal_of([&] { return post(orbit(3), "k"); }), "idempotency-key-reused ");
    EXPECT_NE(post(orbit(2), "l").body, first.body);
    EXPECT_EQ(refusal_of([&] { return post(orbit(2), "a b"); }), "malformed-request ");
    const server::Batches::KeyInUse in_use(services.batches, "busy");
    EXPECT_EQ(refusal_of([&] { return post(orbit(2), "busy"); }), "conflict ");
    EXPECT_EQ(services.batches.store().counts().batches, 2);
}

TEST_F(BatchRoutes, WhatARenderWouldRefuseIsRefusedBeforeTheBatchIsAccepted) {
    const std::string one = "{\"scene\": " + scene() + ", \"frames\": [{}, ";
    EXPECT_EQ(refusal_of([&] { return post(one + R"({"relief": 0}]})"); }),
              "invalid-value /frames/1/relief");
    EXPECT_EQ(refusal_of([&] { return post(one + R"({"alpha": {"image": "none"}}]})"); }),
              "not-found /frames/1/alpha/image");
    EXPECT_EQ(refusal_of([&] { return post(one + R"({"alpha": {"data": "AAAA"}}]})"); }),
              "invalid-value /frames/1/alpha/data");
    EXPECT_EQ(refusal_of([&] { return post(one + R"({"output": {"region": [30, 0, 3, 3]}}]})"); }),
              "invalid-value /frames/1/output/region");
    EXPECT_EQ(refusal_of(
                  [&] { return post(one + R"({"output": {"width": 32768, "height": 32768}}]})"); }),
              "invalid-value /frames/1/output/width");
    services.services.limits.max_scene_cost = 2000;
    EXPECT_EQ(refusal_of([&] {
                  return post(one + R"({"material": {"illumination": "count", "steps": 5000}}]})");
              }),
              "too-costly /frames/1/material/steps");
    Request form = request_of("POST");
    form.headers["Content-Type"] = "multipart/form-data; boundary=b";
    EXPECT_EQ(refusal_of([&] { return submit_batch(form, services.services); }),
              "unsupported-media-type ");
    EXPECT_EQ(services.batches.store().counts().batches, 0);
}

TEST_F(BatchRoutes, AFrameWithBadInputFailsAloneAndCanBeTriedAgain) {
    const std::string png = small_png(2, 16, 16);
    const std::string other = services.images.put(png, decode(png).info).id;
    const std::string id = submitted(
        "{\"scene\": " + scene() + R"(, "frames": [{}, {"height": {"image": ")" + other + "\"}}]}");
    services.images.remove(other);
    services.batches.start();
    const Json batch = finished(id);
    EXPECT_EQ(batch["done"], 1);
    EXPECT_EQ(batch["failed"], 1);
    ASSERT_EQ(batch["problems"].size(), 1u);
    EXPECT_EQ(batch["problems"][0]["frame"], 1);
    EXPECT_EQ(batch["problems"][0]["problem"]["type"], "/problems/not-found");
    EXPECT_EQ(batch["problems"][0]["problem"]["pointer"], "/height/image");
    const Reply frame = get_batch_frame(about(id, "1"), services.services);
    EXPECT_EQ(frame.status, 404);
    EXPECT_EQ(frame.content_type, "application/problem+json");
    services.images.put(png, decode(png).info);
    EXPECT_EQ(Json::parse(retry_batch(about(id), services.services).body)["failed"], 0);
    EXPECT_EQ(finished(id)["done"], 2);
    EXPECT_EQ(refusal_of([&] { return retry_batch(about("no"), services.services); }),
              "not-found ");
}

// The store of images is full: what a batch needs stays, what it needed goes.
TEST_F(BatchRoutes, ImagesOfUnfinishedBatchesAreNotEvicted) {
    const std::string png = small_png(3, 32, 24);
    server::Limits limits;
    limits.max_storage_bytes = png.size() + 100;
    TestServices small(limits);
    image = small.images.put(png, decode(png).info).id;
    (void)submit_batch(request_of("POST", orbit(1)), small.services);
    const std::string other = small_png(4, 32, 24);
    EXPECT_EQ(refusal_of([&] { return small.images.put(other, decode(other).info).id; }),
              "storage-full ");
    small.batches.start();
    for (int i = 0; i < 1000 && small.batches.store().counts().unfinished_batches > 0; ++i)
        std::this_thread::sleep_for(5ms);
    std::this_thread::sleep_for(50ms);
    EXPECT_EQ(refusal_of([&] { return small.images.put(other, decode(other).info).id; }), "none");
}

TEST_F(BatchRoutes, PagesMissNoneAndRepeatNone) {
    std::vector<std::string> ids;
    for (int i = 0; i < 5; ++i) ids.insert(ids.begin(), submitted(orbit(1)));
    std::vector<std::string> listed;
    Request request = request_of("GET");
    request.query = {{"limit", "2"}};
    for (;;) {
        const Json page = Json::parse(list_batches(request, services.services).body);
        for (const Json& batch : page["batches"]) listed.push_back(batch["id"]);
        if (page["next"].is_null()) break;
        (void)submitted(orbit(1));  // newer ones do not move the pages
        request.query = {{"limit", "2"}, {"after", page["next"].get<std::string>()}};
    }
    EXPECT_EQ(listed, ids);
    request.query = {{"after", ids[3]}};
    EXPECT_EQ(Json::parse(list_batches(request, services.services).body)["batches"][0]["id"],
              ids[4]);
    request.query = {{"after", "x"}};
    EXPECT_EQ(refusal_of([&] { return list_batches(request, services.services); }),
              "invalid-value ");
}

TEST_F(BatchRoutes, EventsTellOfEveryFrameAndThenOfTheEnd) {
    services.batches.start();
    const std::string id = submitted(orbit(3));
    const std::string text = text_of(get_batch_events(about(id), services.services));
    for (const char* part : {"id: 1\nevent: frame\n", "id: 3\nevent: frame\n",
                             "id: 4\nevent: end\ndata: {\"id\"", "\"name\":\"0002.png\""})
        EXPECT_NE(text.find(part), std::string::npos) << part << text;
    Request later = about(id);
    later.headers["Last-Event-ID"] = "2";
    const std::string rest = text_of(get_batch_events(later, services.services));
    EXPECT_EQ(rest.find("id: 2\n"), std::string::npos);
    EXPECT_NE(rest.find("id: 3\n"), std::string::npos);
    later.headers["Last-Event-ID"] = "4";
    EXPECT_EQ(get_batch_events(later, services.services).status, 204);
    for (const char* none : {"-1", "5", "9999999999999999999", "4x", "4 ", "0x4", ""}) {
        SCOPED_TRACE(none);
        later.headers["Last-Event-ID"] = none;
        EXPECT_EQ(refusal_of([&] { return get_batch_events(later, services.services); }),
                  "malformed-request ");
    }
    Request early = about(submitted(orbit(100)));
    early.headers["Last-Event-ID"] = "102";
    EXPECT_EQ(refusal_of([&] { return get_batch_events(early, services.services); }),
              "malformed-request ")
        << "nothing is known of that event yet";
}

TEST_F(BatchRoutes, EventsEndWhenTheBatchIsDeletedOrTheServerDrains) {
    const std::string id = submitted(orbit(1));
    Reply events = get_batch_events(about(id), services.services);
    std::thread deleting([&] {
        std::this_thread::sleep_for(50ms);
        EXPECT_EQ(delete_batch(about(id), services.services).status, 204);
    });
    EXPECT_NE(text_of(events).find("\"status\":\"deleted\""), std::string::npos);
    deleting.join();
    EXPECT_EQ(refusal_of([&] { return delete_batch(about(id), services.services); }), "not-found ");
    const std::string other = submitted(orbit(1));
    events = get_batch_events(about(other), services.services);
    services.services.draining = true;
    EXPECT_EQ(text_of(events).find("event: end"), std::string::npos);
}

TEST_F(BatchRoutes, StreamsHaveACapOfTheirOwn) {
    server::Limits limits;
    limits.max_streams = 1;
    TestServices few(limits);
    const std::string png = small_png(1, 32, 24);
    few.images.put(png, decode(png).info);
    const std::string id =
        Json::parse(submit_batch(request_of("POST", orbit(1)), few.services).body)["id"];
    {
        const Reply open = get_batch_events(about(id), few.services);
        EXPECT_EQ(few.batches.streams().open(), 1);
        EXPECT_EQ(refusal_of([&] { return get_batch_archive(about(id), few.services); }),
                  "queue-full ");
    }
    EXPECT_EQ(few.batches.streams().open(), 0) << "given back with the reply";
}

// Between the look at its frame and the one at its file a batch may be deleted.
TEST_F(BatchRoutes, APictureThatIsGoneIsAnErrorInTheLogOnlyWhereItsBatchIsThere) {
    const std::string id = submitted(orbit(1));
    const auto before = spdlog::default_logger();
    std::ostringstream log;
    spdlog::set_default_logger(std::make_shared<spdlog::logger>(
        "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
    EXPECT_EQ(refusal_of([&] { return services.batches.picture("deleted", "a-b-0-1"); }),
              "not-found ");
    EXPECT_EQ(log.str(), "");
    EXPECT_EQ(refusal_of([&] { return services.batches.picture(id, "a-b-0-1"); }), "not-found ");
    EXPECT_NE(log.str().find("removed by somebody else"), std::string::npos);
    spdlog::set_default_logger(before);
}

TEST_F(BatchRoutes, AnArchiveHoldsEveryPictureAndTheProblems) {
    const std::string png = small_png(2, 16, 16);
    const std::string other = services.images.put(png, decode(png).info).id;
    const std::string id = submitted(
        "{\"scene\": " + scene() + R"(, "frames": [{"name": "first.png"}, {"height": {"image": ")" +
        other + "\"}}]}");
    services.images.remove(other);
    Request request = about(id);
    request.query = {{"format", "zip"}};
    // Asked for before anything is rendered, it waits; its length is not known.
    const Reply early = get_batch_archive(request, services.services);
    EXPECT_FALSE(early.stream->size_bytes);
    services.batches.start();
    const std::string streamed = text_of(early);
    finished(id);
    const Reply zip = get_batch_archive(request, services.services);
    EXPECT_EQ(zip.content_type, "application/zip");
    const std::string bytes = text_of(zip);
    EXPECT_EQ(bytes, streamed);
    EXPECT_EQ(zip.stream->size_bytes, bytes.size());
    request.query.clear();
    const Reply tar = get_batch_archive(request, services.services);
    const std::string blocks = text_of(tar);
    EXPECT_EQ(tar.stream->size_bytes, blocks.size());
    const auto picture = get_batch_frame(about(id, "0"), services.services);
    for (const std::string* archive : {&bytes, &blocks}) {
        EXPECT_NE(archive->find("first.png"), std::string::npos);
        EXPECT_NE(archive->find(picture.bytes()), std::string::npos);
        EXPECT_NE(archive->find("problems.json"), std::string::npos);
        EXPECT_NE(archive->find("/problems/not-found"), std::string::npos);
    }
    request.query = {{"format", "rar"}};
    EXPECT_EQ(refusal_of([&] { return get_batch_archive(request, services.services); }),
              "invalid-value ");
}

}  // namespace
}  // namespace relit::test
