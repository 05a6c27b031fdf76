# truetriad_compile_options(target): sets language level, warnings and sanitizers.
function(truetriad_compile_options target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  # Programs (CMake's default: -fPIE) and libraries share precompiled headers, so both get -fPIC.
  target_compile_options(${target} PRIVATE -fPIC)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                         -Wold-style-cast -Woverloaded-virtual -Wimplicit-fallthrough)
  # In optimised std::string and Eigen, g++ 12 warns of overflows and unset values that do not
  # exist.
  target_compile_options(${target} PRIVATE
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-stringop-overflow
      -Wno-stringop-overread -Wno-restrict -Wno-array-bounds -Wno-maybe-uninitialized>)
  if(TRUETRIAD_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  # Debug builds fill new matrices with NaN, so that a forgotten entry is noticed.
  target_compile_definitions(${target} PRIVATE $<$<CONFIG:Debug>:EIGEN_INITIALIZE_MATRICES_BY_NAN>)
  if(TRUETRIAD_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=address,undefined -fno-omit-frame-pointer
                           -fno-sanitize-recover=undefined)
    target_link_options(${target} PUBLIC -fsanitize=address,undefined)
  endif()
  if(TRUETRIAD_FUZZ)
    # -O1 takes a third of the compile time. Assertions of Eigen and of this project stay on.
    target_compile_options(${target} PRIVATE -O1 -gline-tables-only -UNDEBUG -fno-omit-frame-pointer
                           -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined)
    target_link_options(${target} PUBLIC -fsanitize=address,undefined)
  endif()
endfunction()
