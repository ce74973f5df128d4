// encode() for tests that want a file and do not care how it is made.
#pragma once

#include "core/io/encode.h"

namespace relit::test {

inline std::string encoded(const Image& picture, const EncodeOptions& options = {}) {
    return encode(picture, options, {Executor(1)});
}

}  // namespace relit::test
