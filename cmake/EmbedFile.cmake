# cmake -DINPUTS=a,b,... -DOUTPUT=... -DFUNCTION=... -P EmbedFile.cmake: writes a .cc whose function
# std::string_view poise::FUNCTION() gives the bytes of the files, one after the other.
string(REPLACE "," ";" INPUTS "${INPUTS}")
set(bytes)
foreach(input ${INPUTS})
  file(READ ${input} hex HEX)
  string(APPEND bytes "${hex}")
endforeach()
string(REGEX REPLACE "(................................)" "\\1\n" bytes "${bytes}")  # 16 bytes a line
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
file(WRITE ${OUTPUT} "#include <string_view>\n\nnamespace poise {\n\nstd::string_view ${FUNCTION}();\n\n"
     "std::string_view ${FUNCTION}() {\n  static const unsigned char bytes[] = {\n${bytes}};\n"
     "  return {reinterpret_cast<const char*>(bytes), sizeof(bytes)};\n}\n\n}  // namespace poise\n")
