# Compiler settings and third-party packages that every target shares.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib)
if(NOT CMAKE_BUILD_TYPE)
    set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt 9 REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(CLI11 2.1 REQUIRED)
find_package(Boost 1.74 REQUIRED)  # headers only: multiprecision integers of the truth oracle
find_package(Threads REQUIRED)
find_package(ZLIB REQUIRED)  # pages hold their frames and studies their records compressed
find_package(SQLite3 3.36 REQUIRED)  # trocar table --sqlite

add_library(trocar_options INTERFACE)
# Contraction into fused multiply-adds would break error-free transformations and make results differ between CPUs.
target_compile_options(trocar_options INTERFACE -ffp-contract=off -fno-fast-math)
# Calls inside the shared library may be inlined; nobody replaces our symbols at load time.
target_compile_options(trocar_options INTERFACE -fno-semantic-interposition)
target_compile_options(trocar_options INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Wno-sign-conversion)
# Of files that are compiled together clang says where a name of one hides a name of another one's own.
if(NOT (TROCAR_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL "Clang"))
    target_compile_options(trocar_options INTERFACE -Wshadow)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # False alarms of GCC 12 on Eigen and std::string at -O2.
    target_compile_options(trocar_options INTERFACE -Wno-maybe-uninitialized -Wno-restrict -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread)
endif()
if(TROCAR_WERROR)
    target_compile_options(trocar_options INTERFACE -Werror)
endif()
if(TROCAR_SANITIZE)
    target_compile_options(trocar_options INTERFACE -fsanitize=${TROCAR_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(trocar_options INTERFACE -fsanitize=${TROCAR_SANITIZE})
endif()
target_compile_definitions(trocar_options INTERFACE EIGEN_MAX_ALIGN_BYTES=16 EIGEN_MALLOC_ALREADY_ALIGNED=1)  # see library.cmake
target_include_directories(trocar_options INTERFACE ${CMAKE_SOURCE_DIR}/src)
target_link_libraries(trocar_options INTERFACE Eigen3::Eigen Threads::Threads)
# Of what runs while somebody measures.
add_library(trocar_timed_options INTERFACE)
target_link_libraries(trocar_timed_options INTERFACE trocar_options)
if(TROCAR_SANITIZE MATCHES address AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC marks where each of Eigen's temporaries begins and ends, which makes a tick four times slower than all else that
    # ASan and UBSan examine; uses after a scope are left to clang's build of the fuzz targets there.
    target_compile_options(trocar_timed_options INTERFACE -fno-sanitize-address-use-after-scope)
endif()

# Precompiled headers save a third of a build from scratch. Off by default: a compiler cache does better without.
option(TROCAR_PRECOMPILED "Precompile Eigen and common standard headers" OFF)
set(TROCAR_COMMON_HEADERS <Eigen/Core> <Eigen/Geometry> <algorithm> <array> <cmath> <cstdint> <functional> <map> <memory>
    <span> <string> <string_view> <utility> <vector>)
# trocar_precompiled_headers(NAME KIND LINK targets … HEADERS headers …): what trocar_use_precompiled(TARGET NAME) refers
# to. KIND is what refers to it, OBJECT or EXECUTABLE: their position-independent code differs.
function(trocar_precompiled_headers name kind)
    cmake_parse_arguments(PRECOMPILED "" "" "LINK;HEADERS" ${ARGN})
    if(NOT TROCAR_PRECOMPILED)
        return()
    endif()
    set(source ${CMAKE_BINARY_DIR}/generated/${name}.cpp)
    file(CONFIGURE OUTPUT ${source} CONTENT "int main() {}\n")
    if(kind STREQUAL "EXECUTABLE")
        add_executable(${name} EXCLUDE_FROM_ALL ${source})
    else()
        add_library(${name} OBJECT EXCLUDE_FROM_ALL ${source})
    endif()
    target_link_libraries(${name} PRIVATE trocar_options ${PRECOMPILED_LINK})
    target_precompile_headers(${name} PRIVATE ${PRECOMPILED_HEADERS})
endfunction()
function(trocar_use_precompiled target name)
    if(TROCAR_PRECOMPILED)
        target_precompile_headers(${target} REUSE_FROM ${name})
    endif()
endfunction()
trocar_precompiled_headers(trocar_folder_headers OBJECT LINK trocar_timed_options HEADERS ${TROCAR_COMMON_HEADERS})

# Several files of a folder in one translation unit save two thirds of a build from scratch: what templates of JSON,
# Eigen and the command line are made of is compiled once. Off by default: one changed file compiles its neighbours anew.
option(TROCAR_UNITY "Compile the files of a folder together" OFF)
set(TROCAR_ALONE "" CACHE STRING "Source files, absolute, that are compiled alone all the same: those about to change")
# trocar_together(TARGET [FILES]): FILES in one unit, 24 unless a number is given.
function(trocar_together target)
    set(files 24)
    if(ARGN)
        set(files ${ARGN})
    endif()
    if(TROCAR_UNITY)
        set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${files})
        get_target_property(sources ${target} SOURCES)
        foreach(source IN LISTS sources)
            if("${CMAKE_CURRENT_SOURCE_DIR}/${source}" IN_LIST TROCAR_ALONE)
                trocar_alone(${source})
            endif()
        endforeach()
        if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
            # Types of one file look as if they were of an included one.
            target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
        endif()
    endif()
endfunction()
# Files that a vector library includes anew for every instruction set, and tests with names of their own for the same
# things.
function(trocar_alone)
    set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# One object library per folder; together they make the shared library trocar.
# trocar_folder(NAME [UNTIMED] SOURCES … [LINK targets …]). UNTIMED: nothing of it runs while somebody measures, so that it
# is compiled sooner rather than faster.
function(trocar_folder name)
    cmake_parse_arguments(FOLDER "UNTIMED" "" "SOURCES;LINK" ${ARGN})
    if(NOT FOLDER_SOURCES)
        return()
    endif()
    add_library(trocar_${name} OBJECT ${FOLDER_SOURCES})
    trocar_together(trocar_${name})
    target_link_libraries(trocar_${name} PRIVATE trocar_options ${FOLDER_LINK})
    if(FOLDER_UNTIMED)
        # What was precompiled at -O3 cannot be used.
        target_compile_options(trocar_${name} PRIVATE $<$<CONFIG:Release>:-O1>)
    else()
        target_link_libraries(trocar_${name} PRIVATE trocar_timed_options)
        trocar_use_precompiled(trocar_${name} trocar_folder_headers)
    endif()
    set_property(GLOBAL APPEND PROPERTY TROCAR_OBJECTS trocar_${name})
endfunction()
