// The interface described for machines and people: an OpenAPI 3.1 document. The calls stand in
// openapi_paths.json beside this file; the scene's fields, with ranges, defaults and sentences,
// come from the table that parses them (fields.h). Source: api.md.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace relit::server {

struct ProblemCode {
    std::string_view code;
    int status;
    std::string_view title;
};

/// The scope that an operation takes: "open", or what a key has to be good for.
struct OperationScope {
    std::string_view method;  ///< upper case
    std::string_view path;    ///< as the document spells it, except for {extension}
    std::string_view scope;
};

/// What the document says of the server that serves it.
struct OpenApiFacts {
    std::string_view version;
    int max_lights;
    std::vector<ProblemCode> problems;   ///< every code that a problem document may have
    std::vector<OperationScope> scopes;  ///< of every operation
};

[[nodiscard]] std::string openapi_json(const OpenApiFacts& facts);

}  // namespace relit::server
