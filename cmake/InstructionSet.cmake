# The instruction set that all code is compiled for. It decides the last bits of every result, so it is a named choice
# and not this machine's own: x86-64-v3 (AVX2, FMA; processors since about 2013) gives the recorded bits everywhere.
# Only the vector instructions of that set touch a floating-point number. The integer ones (lzcnt, bmi, movbe) are left
# out: virtual machines hide one or the other, and no bit of a result depends on them.
# Sets POISE_MARCH (flag, may be empty) and POISE_BITS (what bits a build gives, for `poise --version` and logs).
set(POISE_INSTRUCTION_SET "" CACHE STRING
    "x86-64-v3 (default where the processor has it), x86-64 (any such processor), or native (bits of its own)")
set_property(CACHE POISE_INSTRUCTION_SET PROPERTY STRINGS "" x86-64-v3 x86-64 native)

if(DEFINED POISE_NATIVE)
  message(FATAL_ERROR "POISE_NATIVE is gone: -DPOISE_INSTRUCTION_SET=native (bits of its own) takes its place")
endif()

# What the processor lacks of x86-64-v3's vector instructions, by the name that /proc/cpuinfo gives it.
function(poise_missing_of_v3 result)
  file(STRINGS /proc/cpuinfo flags REGEX "^flags" LIMIT_COUNT 1)
  string(REGEX REPLACE "^flags[ \t]*:[ ]*" "" flags "${flags}")
  string(REPLACE " " ";" flags "${flags}")
  set(missing)
  foreach(flag avx avx2 fma)
    if(NOT flag IN_LIST flags)
      list(APPEND missing ${flag})
    endif()
  endforeach()
  set(${result} "${missing}" PARENT_SCOPE)
endfunction()

set(_set "${POISE_INSTRUCTION_SET}")
set(POISE_MARCH)
if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  if(_set AND NOT _set STREQUAL "native")
    message(FATAL_ERROR "POISE_INSTRUCTION_SET=${_set}: this processor is ${CMAKE_SYSTEM_PROCESSOR}; leave it out")
  endif()
  message(STATUS "Processor ${CMAKE_SYSTEM_PROCESSOR}: this build's bits are its own, those of x86-64 differ")
  set(POISE_BITS ${CMAKE_SYSTEM_PROCESSOR})
elseif(_set STREQUAL "")
  poise_missing_of_v3(_missing)
  if(_missing)
    list(JOIN _missing " " _missing)
    message(NOTICE "This processor lacks ${_missing} of x86-64-v3: building for x86-64. Its results differ from the "
                   "recorded ones in the last bits; the test that compares them is skipped.")
    set(POISE_BITS x86-64)
  else()
    set(POISE_BITS x86-64-v3)
  endif()
elseif(_set MATCHES "^(x86-64-v3|x86-64|native)$")
  set(POISE_BITS ${_set})
else()
  message(FATAL_ERROR "POISE_INSTRUCTION_SET=${_set}: must be x86-64-v3, x86-64 or native")
endif()
if(POISE_BITS STREQUAL "native")
  message(NOTICE "Building for this machine's processor (-march=native): its bits are its own, not the recorded ones")
  set(POISE_MARCH -march=native)
elseif(POISE_BITS STREQUAL "x86-64-v3")
  set(POISE_MARCH -march=x86-64 -mavx2 -mfma)
elseif(POISE_BITS STREQUAL "x86-64")
  set(POISE_MARCH -march=x86-64)
endif()
