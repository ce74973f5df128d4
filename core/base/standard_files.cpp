#include "core/base/standard_files.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <initializer_list>

namespace relit {

void hold_standard_files() {
    for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (::fcntl(descriptor, F_GETFD) >= 0) continue;
        const int wrong_way = descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY;
        // POSIX gives the lowest free number, and those below are taken by now.
        if (::open("/dev/null", wrong_way) != descriptor) std::abort();
    }
}

}  // namespace relit
