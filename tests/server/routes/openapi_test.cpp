// The description of the interface, held against the table of routes and the table of problems.
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <set>

#include "server/http/problem.h"
#include "server/routes/catalogue.h"
#include "server/routes/routes.h"
#include "tests/support/test_server.h"

namespace relit::test {
namespace {

using Json = nlohmann::json;

class OpenApi : public testing::Test {
protected:
    OpenApi() {
        server::Request request;
        request.method = "GET";
        document = Json::parse(server::get_openapi(request, services_.services).bytes());
    }
    TestServices services_;
    Json document;
};

std::string lower_case(std::string_view text) {
    std::string lower(text);
    for (char& c : lower) c = char(std::tolower(c));
    return lower;
}

// "get /v1/images/{id}"; a path with {extension} once for each.
std::set<std::string> described_calls(const Json& document) {
    std::set<std::string> calls;
    for (const auto& [path, item] : document["paths"].items())
        for (const auto& [method, operation] : item.items()) {
            if (method == "parameters") continue;
            const auto template_at = path.find("{extension}");
            if (template_at == std::string::npos) {
                calls.insert(method + " " + path);
                continue;
            }
            for (const Json& parameter : item["parameters"]) {
                if (parameter.value("name", "") != "extension") continue;
                for (const Json& extension : parameter["schema"]["enum"])
                    calls.insert(method + " " + path.substr(0, template_at) +
                                 extension.get<std::string>());
            }
        }
    return calls;
}

TEST_F(OpenApi, DescribesEveryCallAndNoOther) {
    std::set<std::string> calls;
    for (const server::Route& route : server::routes({}))
        if (!route.pattern.starts_with("/studio/"))  // files of the pages
            calls.insert(lower_case(route.method) + " " + std::string(route.pattern));
    EXPECT_EQ(described_calls(document), calls);
}

TEST_F(OpenApi, EveryReferenceLeadsSomewhere) {
    int references = 0;
    const std::function<void(const Json&)> look = [&](const Json& place) {
        if (place.is_object() && place.contains("$ref")) {
            const std::string target = place["$ref"].get<std::string>().substr(1);
            EXPECT_TRUE(document.contains(Json::json_pointer(target))) << target;
            ++references;
        }
        if (place.is_structured())
            for (const Json& member : place) look(member);
    };
    look(document);
    EXPECT_GT(references, 30);
}

TEST_F(OpenApi, ListsEveryProblemCode) {
    const std::string description =
        document["components"]["schemas"]["Problem"]["description"].get<std::string>();
    const Json& types = document["components"]["schemas"]["Problem"]["properties"]["type"]["enum"];
    EXPECT_EQ(types.size(), server::problem_kinds().size());
    for (const server::ProblemKind& kind : server::problem_kinds()) {
        const std::string type = "/problems/" + std::string(kind.code);
        EXPECT_NE(std::find(types.begin(), types.end(), type), types.end()) << type;
        EXPECT_NE(description.find(kind.code), std::string::npos) << type;
    }
}

TEST_F(OpenApi, NamesEveryOperationOnceAndSaysWhatItDoes) {
    std::set<std::string> ids;
    for (const auto& [path, item] : document["paths"].items())
        for (const auto& [method, operation] : item.items()) {
            if (method == "parameters") continue;
            EXPECT_TRUE(ids.insert(operation.at("operationId")).second) << path;
            EXPECT_FALSE(operation.at("summary").get<std::string>().empty()) << path;
            EXPECT_FALSE(operation.at("responses").empty()) << path;
        }
}

TEST_F(OpenApi, SaysTheScopeOfEveryOperation) {
    const Json& paths = document["paths"];
    EXPECT_EQ(paths["/healthz"]["get"]["security"], Json::array());
    EXPECT_EQ(paths["/v1/images"]["post"]["security"], Json::parse(R"([{}, {"key": ["render"]}])"));
    EXPECT_EQ(paths["/v1/images/{id}/relit.{extension}"]["get"]["security"],
              Json::parse(R"([{}, {"key": ["render"]}, {"signedUrl": ["render"]}])"));
    for (const auto& [path, item] : paths.items())
        for (const auto& [method, operation] : item.items()) {
            if (method == "parameters") continue;
            ASSERT_TRUE(operation.contains("security")) << method << " " << path;
            for (const Json& scheme : operation["security"])
                for (const auto& [name, scopes] : scheme.items())
                    EXPECT_TRUE(document["components"]["securitySchemes"].contains(name)) << name;
        }
}

TEST_F(OpenApi, SaysTheLimitOfLightsThatThisServerHas) {
    EXPECT_EQ(document["components"]["schemas"]["Scene"]["properties"]["lights"]["maxItems"],
              services_.limits.max_lights);
}

}  // namespace
}  // namespace relit::test
