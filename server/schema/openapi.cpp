#include "server/schema/openapi.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "embedded/openapi.h"
#include "server/schema/field_schema.h"
#include "server/text.h"

namespace relit::server {
namespace {

OrderedJson problem_schema(const std::vector<ProblemCode>& problems) {
    OrderedJson types = OrderedJson::array();
    std::string list;
    for (const ProblemCode& problem : problems) {
        types.push_back("/problems/" + std::string(problem.code));
        list += fmt::format("\n- `{}` ({}): {}", problem.code, problem.status, problem.title);
    }
    const OrderedJson text = {{"type", "string"}};
    return {
        {"type", "object"},
        {"description", "RFC 9457. The codes, which are the last part of `type`:" + list},
        {"properties",
         {{"type", {{"type", "string"}, {"enum", std::move(types)}}},
          {"title", text},
          {"status", {{"type", "integer"}}},
          {"detail", {{"type", "string"}, {"description", "A sentence for the client."}}},
          {"pointer", {{"type", "string"}, {"description", "The field to blame (RFC 6901)."}}}}},
        {"required", {"type", "title", "status", "detail"}},
    };
}

// The scene's fields as parameters of a URL, behind the short forms of a light.
void add_flat_parameters(OrderedJson& parameters) {
    for (const FlatField& field : flat_fields()) {
        if (field.path.starts_with("height.") || field.path == "output.format") continue;
        OrderedJson schema = field.schema;
        OrderedJson parameter = {
            {"name", field.path}, {"in", "query"}, {"description", schema["description"]}};
        schema.erase("description");
        // A list is written with commas between its numbers.
        parameter["style"] = "form";
        parameter["explode"] = false;
        parameter["schema"] = std::move(schema);
        parameters.push_back(std::move(parameter));
    }
}

// {extension} stands for several paths of one scope.
bool is_path(const std::string& described, std::string_view path) {
    const auto end = described.find("{extension}");
    return end == std::string::npos ? path == described
                                    : path.starts_with(described.substr(0, end));
}

bool is_method(const std::string& described, std::string_view method) {
    return std::equal(described.begin(), described.end(), method.begin(), method.end(),
                      [](char a, char b) { return a == lower(b); });
}

// What one of these has to hold; {} is a server that asks for no keys.
OrderedJson security_of(std::string_view scope, bool is_get) {
    if (scope == "open") return OrderedJson::array();
    const OrderedJson scopes = OrderedJson::array({scope});
    OrderedJson security = {OrderedJson::object(), {{"key", scopes}}};
    if (is_get) security.push_back({{"signedUrl", scopes}});
    return security;
}

void add_security(const std::string& path, OrderedJson& operations,
                  const std::vector<OperationScope>& scopes) {
    for (auto& [method, operation] : operations.items())
        for (const OperationScope& row : scopes)
            if (is_path(path, row.path) && is_method(method, row.method))
                operation["security"] = security_of(row.scope, method == "get");
}

}  // namespace

std::string openapi_json(const OpenApiFacts& facts) {
    OrderedJson document = OrderedJson::parse(embedded::openapi::openapi_paths_json());
    document["info"]["version"] = facts.version;
    OrderedJson schemas = scene_schemas(facts.max_lights);
    schemas.update(document["components"]["schemas"]);
    schemas["Problem"] = problem_schema(facts.problems);
    document["components"]["schemas"] = std::move(schemas);
    for (auto& [path, operations] : document["paths"].items()) {
        add_security(path, operations, facts.scopes);
        if (path.find("/relit.") != std::string::npos)
            add_flat_parameters(operations["get"]["parameters"]);
    }
    return document.dump();
}

}  // namespace relit::server
