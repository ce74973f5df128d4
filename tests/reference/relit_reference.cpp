// relit_reference FILE.json: evaluates every case of a file in the format of specification
// "translucency", section 8, with core/scatter. Prints a line per case and the closing count.
// Exit status: 0 all agree, 1 one differs, 2 the file cannot be read or judged.
#include <fstream>
#include <iostream>
#include <sstream>

#include "tests/reference/judge.h"

int main(int argc, char** argv) {
    if (argc != 2) {
        std::cerr << "usage: relit_reference FILE.json\n";
        return 2;
    }
    std::ifstream file(argv[1], std::ios::binary);
    std::ostringstream text;
    if (!(text << file.rdbuf())) {
        std::cerr << argv[1] << ": cannot be read, or is empty\n";
        return 2;
    }
    return relit::test::reference::judge(text.str(), std::cout, std::cerr);
}
