# cmake -DOUTPUT=file.cpp -DFOLDER=folder -DFILES="name;..." -P embed_files.cmake
# Writes the definition of pneuma::scene_io::embedded_files, one byte array a file, in the order of FILES.
set(arrays "")
set(table "")
set(count 0)
foreach(name IN LISTS FILES)
  file(READ ${FOLDER}/${name} hex HEX)
  string(REGEX REPLACE "(..)" "'\\\\x\\1'," bytes "${hex}")
  string(APPEND arrays "constexpr char file_${count}[] = {${bytes}'\\0'};\n")
  string(APPEND table "    {\"${name}\", {file_${count}, sizeof(file_${count}) - 1}},\n")
  math(EXPR count "${count} + 1")
endforeach()

file(WRITE ${OUTPUT} "#include \"scene_io/embedded_files.h\"

namespace pneuma::scene_io {
namespace {
${arrays}}  // namespace

const EmbeddedFile embedded_files[] = {
${table}    {\"\", \"\"},
};
const std::size_t embedded_file_count = ${count};

}  // namespace pneuma::scene_io
")
