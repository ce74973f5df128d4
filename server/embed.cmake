# Files as bytes in a program, for what it must have with it wherever it runs: pages, samples.
#
#   include(embed.cmake)                                     # beside the CMakeLists.txt of the target
#   relit_embed(<target> <set> <file>...)
#   relit_embed(relit_server page ../clients/studio/index.html ../clients/studio/docs.js)
#
# gives the target (which must exist, here) and its customers a header with one function per file, named by the file, and
# one for all of them with their names:
#
#   #include "embedded/page.h"
#   std::string_view page = relit::embedded::page::index_html();      // for as long as the program runs
#   for (const auto& [name, bytes] : relit::embedded::page::files())  // "index.html", …
#
# The assembler copies the bytes (.incbin), so that megabytes cost the compiler nothing; a file that changes is assembled
# and linked anew, and one that is missing stops CMake. A byte 0 follows each file and is not counted.

function(relit_embed target set)
    set(names "")
    set(paths "")
    set(declarations "")
    set(list "")
    set(count 0)
    set(blocks "")
    foreach(file IN LISTS ARGN)
        get_filename_component(path "${file}" ABSOLUTE)
        get_filename_component(name "${path}" NAME)
        string(MAKE_C_IDENTIFIER "${name}" name)
        if(NOT EXISTS "${path}")
            message(FATAL_ERROR "relit_embed(${target} ${set}): there is no file ${path}")
        endif()
        if(name IN_LIST names)
            message(FATAL_ERROR "relit_embed(${target} ${set}): two files would be called ${name}()")
        endif()
        list(APPEND names "${name}")
        list(APPEND paths "${path}")
        get_filename_component(file_name "${path}" NAME)
        math(EXPR count "${count} + 1")
        string(APPEND list "        {\"${file_name}\", ${name}()},\n")
        set(symbol "relit_embedded_${set}_${name}")
        string(APPEND declarations
            "extern \"C\" const char ${symbol}_begin[];\n"
            "extern \"C\" const char ${symbol}_end[];\n"
            "inline std::string_view ${name}() { return {${symbol}_begin, ${symbol}_end}; }\n")
        string(APPEND blocks
            "asm(R\"(\n"
            ".section .rodata\n.balign 16\n"
            ".global ${symbol}_begin\n.global ${symbol}_end\n"
            "${symbol}_begin:\n.incbin \"${path}\"\n${symbol}_end:\n.byte 0\n"
            ".previous\n)\");\n")
    endforeach()

    set(folder "${CMAKE_CURRENT_BINARY_DIR}/embed")
    set(source "${folder}/embedded/${set}.cpp")
    # Written only where the text differs.
    file(CONFIGURE OUTPUT "${folder}/embedded/${set}.h" @ONLY CONTENT
"// Made by relit_embed().\n#pragma once\n\n#include <array>\n#include <string_view>\n#include <utility>\n
namespace relit::embedded::${set} {\n${declarations}
inline std::array<std::pair<std::string_view, std::string_view>, ${count}> files() {
    return {{\n${list}    }};\n}\n}  // namespace relit::embedded::${set}\n")
    file(CONFIGURE OUTPUT "${source}" @ONLY CONTENT "// Made by relit_embed().\n${blocks}")
    set_source_files_properties("${source}" PROPERTIES OBJECT_DEPENDS "${paths}")
    target_sources(${target} PRIVATE "${source}")
    target_include_directories(${target} PUBLIC "${folder}")
endfunction()
