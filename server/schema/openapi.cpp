#include "server/schema/openapi.h"

#include <spdlog/fmt/fmt.h>

#include "embedded/openapi.h"
#include "server/schema/field_schema.h"

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

}  // namespace

std::string openapi_json(const OpenApiFacts& facts) {
    OrderedJson document = OrderedJson::parse(embedded::openapi::openapi_paths_json());
    document["info"]["version"] = facts.version;
    OrderedJson schemas = scene_schemas(facts.max_lights);
    schemas.update(document["components"]["schemas"]);
    schemas["Problem"] = problem_schema(facts.problems);
    document["components"]["schemas"] = std::move(schemas);
    for (auto& [path, operations] : document["paths"].items())
        if (path.find("/relit.") != std::string::npos)
            add_flat_parameters(operations["get"]["parameters"]);
    return document.dump();
}

}  // namespace relit::server
