#include "tests/fuzz/claims.h"

#include <nlohmann/json.hpp>

#include "server/http/problem.h"

namespace relit::fuzz {

void claim_is_refusal(const Error& error) {
    const server::ProblemKind& kind = server::problem_kind(error.code);
    claim(kind.code == error.code, "an error's code is one of the interface's");
    claim(kind.status >= 400 && kind.status < 500, "what was sent is to blame");
    const auto document = nlohmann::json::parse(server::problem_reply(error).body);
    const auto detail = document.at("detail").get<std::string>();
    claim(!detail.empty(), "a refusal has words");
    const std::string pointer = document.value("pointer", "");
    claim(pointer.empty() || pointer.front() == '/', "a pointer is empty or begins at the root");
}

}  // namespace relit::fuzz
