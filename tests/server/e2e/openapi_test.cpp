// Every example of the interface's description, sent to the real server.
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using Json = nlohmann::json;

class OpenApiEndToEnd : public testing::Test {
protected:
    OpenApiEndToEnd() : document(Json::parse(http(relitd.port(), "GET", "/openapi.json").body)) {}

    // A parameter itself, or the one that it refers to.
    [[nodiscard]] const Json& resolved(const Json& item) const {
        if (!item.contains("$ref")) return item;
        return document.at(Json::json_pointer(item["$ref"].get<std::string>().substr(1)));
    }

    // One that is not there before and has a picture.
    [[nodiscard]] std::string finished_batch() const {
        const Json& examples = document["paths"]["/v1/batches"]["post"]["requestBody"]["content"]
                                       ["application/json"]["examples"];
        const auto submitted =
            http(relitd.port(), "POST", "/v1/batches", examples["scenes"]["value"].dump());
        const std::string id = Json::parse(submitted.body)["id"];
        for (int i = 0; i < 500; ++i) {
            const auto batch = http(relitd.port(), "GET", "/v1/batches/" + id);
            if (Json::parse(batch.body)["status"] == "done") return id;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        ADD_FAILURE() << "the batch is not finished";
        return id;
    }

    // The target with the examples of its parameters; those without an example are left out.
    [[nodiscard]] std::string target_of(std::string path, const Json& item,
                                        const Json& operation) const {
        std::string query;
        for (const Json& parameters : {item.value("parameters", Json::array()),
                                       operation.value("parameters", Json::array())})
            for (const Json& reference : parameters) {
                const Json& parameter = resolved(reference);
                if (!parameter.contains("example")) {
                    EXPECT_FALSE(parameter.value("required", false)) << path << parameter;
                    continue;
                }
                const std::string name = parameter["name"];
                std::string value = parameter["example"].is_string()
                                        ? parameter["example"].get<std::string>()
                                        : parameter["example"].dump();
                // Ids of batches are made by the server.
                if (name == "id" && path.starts_with("/v1/batches/")) value = finished_batch();
                if (parameter["in"] == "path")
                    path.replace(path.find("{" + name + "}"), name.size() + 2, value);
                else query += (query.empty() ? "?" : "&") + name + "=" + value;
            }
        return path + query;
    }

    void expect_described(const Json& operation, const HttpReply& reply,
                          const std::string& what) const {
        ASSERT_LT(reply.status, 300) << what << ": " << reply.body.substr(0, 300);
        const Json& described = operation["responses"].at(std::to_string(reply.status));
        const Json& answer = resolved(described);
        if (!answer.contains("content")) return;
        const std::string type = reply.header("content-type");
        bool known = false;
        for (const auto& [media, content] : answer["content"].items())
            known = known || type.starts_with(media) ||
                    (media == "image/*" && type.starts_with("image/"));
        EXPECT_TRUE(known) << what << " answers " << type;
    }

    RelitProcess relitd;
    Json document;
};

TEST_F(OpenApiEndToEnd, EveryGetOfAnExampleIsAnsweredAsDescribed) {
    int calls = 0;
    for (const auto& [path, item] : document["paths"].items()) {
        if (!item.contains("get")) continue;
        const std::string target = target_of(path, item, item["get"]);
        expect_described(item["get"], http(relitd.port(), "GET", target), target);
        ++calls;
    }
    EXPECT_GE(calls, 15);
}

TEST_F(OpenApiEndToEnd, EveryExampleOfABodyIsAnsweredAsDescribed) {
    int calls = 0;
    for (const auto& [path, item] : document["paths"].items()) {
        if (!item.contains("post") || !item["post"].contains("requestBody")) continue;
        const Json& contents = item["post"]["requestBody"]["content"];
        if (!contents.contains("application/json")) continue;
        for (const auto& [name, example] : contents["application/json"]["examples"].items()) {
            const auto reply = http(relitd.port(), "POST", path, example["value"].dump());
            expect_described(item["post"], reply, path + " " + name);
            ++calls;
        }
    }
    EXPECT_GE(calls, 8);
}

TEST_F(OpenApiEndToEnd, AnImageIsStoredAndForgottenAsDescribed) {
    const Json& images = document["paths"]["/v1/images"];
    const auto stored = http(relitd.port(), "POST", "/v1/images", small_png(7));
    expect_described(images["post"], stored, "POST");
    EXPECT_EQ(stored.status, 201);
    const std::string id = Json::parse(stored.body)["id"];
    const Json& one = document["paths"]["/v1/images/{id}"];
    expect_described(one["delete"], http(relitd.port(), "DELETE", "/v1/images/" + id), "DELETE");
}

// A scene in any form is the scene that the dry run answers, and its picture has that ETag.
TEST_F(OpenApiEndToEnd, TheDryRunAnswersASceneThatRendersToItsEtag) {
    const auto plato =
        document["components"]["parameters"]["ImageId"]["example"].get<std::string>();
    const std::string scene =
        R"({"preset": "bronze", "height": {"image": ")" + plato + R"("}, "output": {"width": 64}})";
    const auto dry = http(relitd.port(), "POST", "/v1/scene", scene);
    ASSERT_EQ(dry.status, 200) << dry.body;
    EXPECT_EQ(Json::parse(dry.body)["relief"], 0.12);
    const auto from_preset = http(relitd.port(), "POST", "/v1/render", scene);
    const auto from_dry = http(relitd.port(), "POST", "/v1/render", dry.body);
    const auto from_url = http(relitd.port(), "GET",
                               "/v1/images/" + plato + "/relit.png?preset=bronze&output.width=64");
    ASSERT_EQ(from_url.status, 200) << from_url.body;
    EXPECT_EQ(from_preset.header("etag"), dry.header("etag"));
    EXPECT_EQ(from_dry.header("etag"), dry.header("etag"));
    EXPECT_EQ(from_url.header("etag"), dry.header("etag"));
    EXPECT_EQ(from_preset.body, from_dry.body);
    EXPECT_EQ(from_preset.body, from_url.body);
}

TEST_F(OpenApiEndToEnd, EveryPresetAndEverySampleRenders) {
    const Json samples = Json::parse(http(relitd.port(), "GET", "/v1/samples").body)["samples"];
    const Json presets = Json::parse(http(relitd.port(), "GET", "/v1/presets").body)["presets"];
    ASSERT_EQ(samples.size(), 6u);
    ASSERT_EQ(presets.size(), 20u);
    const std::string relief = samples[0]["id"];
    const auto render = [&](Json scene, const std::string& height) {
        scene["height"] = {{"image", height}};
        scene["output"] = {{"width", 48}, {"accuracy", "preview"}, {"format", "jpeg"}};
        return http(relitd.port(), "POST", "/v1/render", scene.dump());
    };
    for (const Json& preset : presets) {
        EXPECT_EQ(render({{"preset", preset["name"]}}, relief).status, 200) << preset["name"];
        EXPECT_EQ(render(preset["scene"], relief).status, 200) << preset["name"];
    }
    for (const Json& sample : samples) {
        const bool is_relief = sample["kind"] == "relief";
        EXPECT_EQ(render(sample["scene"], is_relief ? sample["id"] : samples[0]["id"]).status, 200)
            << sample["name"];
        const auto content = http(relitd.port(), "GET",
                                  "/v1/images/" + sample["id"].get<std::string>() + "/content");
        EXPECT_EQ(content.status, 200) << sample["name"];
        EXPECT_EQ(content.header("etag"), '"' + sample["id"].get<std::string>() + '"');
    }
}

}  // namespace
}  // namespace relit::test
