// What always holds, whatever the input: for the targets, which are asked nothing else.
#pragma once

#include <stdexcept>
#include <string>

#include "core/base/error.h"

namespace relit::fuzz {

/// @throws std::logic_error with the claim where it does not hold
inline void claim(bool holds, const std::string& sentence) {
    if (!holds) throw std::logic_error("does not hold: " + sentence);
}

/// A refusal is the client's fault, is one of the interface's problems and can be told: as JSON, in
/// UTF-8.
void claim_is_refusal(const Error& error);

/// Whether `call` accepts its input; otherwise it has refused it.
template <class Call>
[[nodiscard]] bool accepts(const Call& call) {
    try {
        call();
        return true;
    } catch (const Error& error) {
        claim_is_refusal(error);
        return false;
    }
}

}  // namespace relit::fuzz
