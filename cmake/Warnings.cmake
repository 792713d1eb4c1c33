# cdprcal_warnings: what every target of this project is compiled with. It is linked PRIVATE and never installed, so
# nobody else's build sees it.
add_library(cdprcal_warnings INTERFACE)

target_compile_options(
  cdprcal_warnings
  INTERFACE
    -Wall
    -Wextra
    -Wpedantic
    -Wconversion # without -Wsign-conversion: Eigen's indices are signed, the standard library's are not
    -Wshadow
    -Wcast-qual
    -Wnon-virtual-dtor
    -Woverloaded-virtual
    -Wextra-semi
    -Wunused
    $<$<CXX_COMPILER_ID:GNU>:-Wduplicated-cond>
    $<$<CXX_COMPILER_ID:GNU>:-Wlogical-op>
    # GCC 12's flow analysis misfires on Eigen's inlined expressions and on "text" + std::string (its bug 105651); the
    # sanitize preset finds the real cases.
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>)

if(CDPRCAL_WARNINGS_AS_ERRORS)
  target_compile_options(cdprcal_warnings INTERFACE -Werror)
endif()
