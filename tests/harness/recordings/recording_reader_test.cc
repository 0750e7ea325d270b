// Files of others: the same rows from each format, and one line for what cannot be read.

#include "harness/log/recording_reader.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <zip.h>

#include <cmath>
#include <cstring>
#include <fstream>

#include "controller/common/errors.h"
#include "harness/base/files.h"
#include "harness/log/mcap_writer.h"
#include "harness/log/npy_file.h"
#include "harness/recordings/channels.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::recording_reader_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr size_t kRows = 5;
double Time(size_t row) { return 10.0 + 0.5 * static_cast<double>(row); }
double Position(size_t row, size_t joint) {
  return 0.1 * static_cast<double>(row) - static_cast<double>(joint);
}
double Effort(size_t row, size_t joint) { return 3.0 + static_cast<double>(row * joint); }

class Formats : public ::testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path Path(const std::string& name) const { return folder_.path() / name; }
  std::filesystem::path Write(const std::string& name, const std::string& text) const {
    std::ofstream(Path(name)) << text;
    return Path(name);
  }
  /// All rows hold time, two positions and two torques.
  static void ExpectRows(RecordingReader* reader) {
    std::vector<double> row;
    for (size_t i = 0; i < kRows; ++i) {
      ASSERT_TRUE(reader->Next(&row)) << i;
      ASSERT_GE(row.size(), 5U);
      EXPECT_DOUBLE_EQ(row[0], Time(i));
      for (size_t joint = 0; joint < 2; ++joint) {
        EXPECT_DOUBLE_EQ(row[1 + joint], Position(i, joint));
        EXPECT_DOUBLE_EQ(row[row.size() - 2 + joint], Effort(i, joint));
      }
    }
    EXPECT_FALSE(reader->Next(&row));
  }
  static std::string Rows(const std::string& separator, char point = '.') {
    std::ostringstream text;
    text.precision(17);
    for (size_t i = 0; i < kRows; ++i) {
      text << Time(i);
      for (size_t joint = 0; joint < 2; ++joint) text << separator << Position(i, joint);
      for (size_t joint = 0; joint < 2; ++joint) text << separator << Effort(i, joint);
      text << "\n";
    }
    std::string rows = text.str();
    if (point != '.') std::replace(rows.begin(), rows.end(), '.', point);
    return rows;
  }

  TemporaryFolder folder_;
};

TEST_F(Formats, TextWithAndWithoutHeaders) {
  for (const std::string& text :
       {"t,a,b,c,d\n" + Rows(","), "# made by hand\n" + Rows(" "), Rows("\t"), Rows("; ", ','),
        "\"t\";\"a\";\"b\";\"c\";\"d\"\r\n" + Rows(";", ','), "\xef\xbb\xbft, a, b, c, d\n\n" + Rows(", ")}) {
    SCOPED_TRACE(text);
    ExpectRows(OpenRecording(Write("rows.csv", text)).get());
  }
  EXPECT_THAT(OpenRecording(Write("named.csv", "t,a,b,c,d\n" + Rows(",")))->names(),
              ElementsAre("t", "a", "b", "c", "d"));
  // RFC 4180 allows separators, quotes and ends of lines in quotes.
  const auto quoted =
      OpenRecording(Write("quoted.csv", "t,\"a;b,c\",\"d\"\"e\",\"f\ng\",\"'=h\"\n" + Rows(",")));
  EXPECT_THAT(quoted->names(), ElementsAre("t", "a;b,c", "d\"e", "f\ng", "=h"));
  ExpectRows(quoted.get());
  // Numbers on lines of their own.
  ExpectRows(OpenRecording(Write("column.txt", Rows("\n")), "", 5).get());
}

TEST_F(Formats, TextThatIsNone) {
  const auto problem = [&](const std::string& text) {
    const auto path = Write("bad.csv", text);
    return MessageOf<InputError>([&] {
      const auto reader = OpenRecording(path);
      std::vector<double> row;
      while (reader->Next(&row)) {
      }
      return 0;
    });
  };
  EXPECT_THAT(problem(""), HasSubstr("bad.csv: is empty"));
  EXPECT_THAT(problem("t,a\n1,2\n3\n"),
              HasSubstr("bad.csv:3: must have 2 numbers as the rows before, got 1"));
  EXPECT_THAT(problem("t,a\n1,2\n3,x1\n"), HasSubstr("bad.csv:3: column a: must be a number, got \"x1\""));
  EXPECT_THAT(problem("1 2\n3 4e999x\n"), HasSubstr("bad.csv:2: column 2"));
  EXPECT_THAT(problem(std::string("ab\0cd\n", 6)), HasSubstr("no recording that is known"));
}

std::string JointStateJson(size_t row) {
  std::ostringstream text;
  text.precision(17);
  text << R"({"name": ["a", "b"], "position": [)" << Position(row, 0) << "," << Position(row, 1)
       << R"(], "velocity": [], "effort": [)" << Effort(row, 0) << "," << Effort(row, 1) << "]}";
  return text.str();
}

std::string MessageOfOpening(const std::filesystem::path& path) {
  return MessageOf<InputError>([&] { return OpenRecording(path); });
}

/// A record of MCAP's.
std::string McapRecord(char opcode, std::uint64_t length, const std::string& content) {
  return opcode + std::string(reinterpret_cast<const char*>(&length), sizeof length) + content;
}

// 24,000 brackets overflowed the stack.
TEST_F(Formats, JsonInJsonIsBounded) {
  for (const size_t depth : {30U, 40U, 24000U}) {
    McapWriter writer(Path("deep.mcap"));
    const auto channel = writer.AddChannel("/a", "a", "{}");
    for (size_t i = 0; i < 2; ++i)
      writer.Write(channel, Time(i),
                   R"({"a": )" + std::string(depth, '[') + "1" + std::string(depth, ']') + "}");
    writer.Finish();
    if (depth < 32) {
      EXPECT_EQ(OpenRecording(Path("deep.mcap"))->names().size(), 2U);
    } else {
      EXPECT_THAT(MessageOfOpening(Path("deep.mcap")), HasSubstr("at most 32 brackets inside each other"));
    }
  }
}

// A size in a file asks for no more memory than the file can hold.
TEST_F(Formats, StatedSizesAreNotTrusted) {
  constexpr std::uint64_t kStated = 0xffffff00U;
  const std::string begin = "\x89MCAP0\r\n";
  EXPECT_THAT(MessageOfOpening(Write("record.mcap", begin + McapRecord(5, kStated, "abc"))),
              HasSubstr("record.mcap: ends within a record, of 4294967040 bytes"));
  for (const std::string compression : {"", "lz4", "zstd"}) {
    std::string chunk(16, '\0');
    chunk.append(reinterpret_cast<const char*>(&kStated), 8);
    chunk +=
        std::string(4, '\0') + std::string(1, static_cast<char>(compression.size())) + std::string(3, '\0');
    chunk += compression + std::string("\x02\0\0\0\0\0\0\0ab", 10);
    const std::string bytes = begin + McapRecord(6, chunk.size(), chunk);
    EXPECT_THAT(MessageOfOpening(Write("chunk.mcap", bytes)), HasSubstr("has a chunk of 4294967040 bytes"));
  }
  int error = 0;
  zip_t* archive = zip_open(Path("zeros.npz").c_str(), ZIP_CREATE, &error);
  const std::string zeros(size_t{300} << 20U, '\0');
  zip_file_add(archive, "q.npy", zip_source_buffer(archive, zeros.data(), zeros.size(), 0), 0);
  zip_close(archive);
  EXPECT_THAT(MessageOfOpening(Path("zeros.npz")), HasSubstr("q.npy: is longer than its file can hold"));
  const hid_t file = H5Fcreate(Path("empty.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hsize_t extents[2] = {size_t{1} << 34U, 7};
  const hid_t space = H5Screate_simple(2, extents, nullptr);
  H5Dclose(H5Dcreate2(file, "q", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Sclose(space);
  H5Fclose(file);
  EXPECT_THAT(MessageOfOpening(Path("empty.h5")), HasSubstr("empty.h5"));
}

TEST_F(Formats, EndlessFilesAreRefused) {
  EXPECT_THAT(MessageOfOpening("/dev/zero"), HasSubstr("a line of more than 1048574 bytes"));
  EXPECT_THAT(MessageOf<InputError>([] { return ReadBytes("/dev/zero"); }),
              HasSubstr("/dev/zero: cannot be read: is longer than 64 MiB"));
}

TEST_F(Formats, McapOfJson) {
  {
    McapWriter writer(Path("a.mcap"));
    const auto channel = writer.AddChannel("/joint_states", "sensor_msgs/msg/JointState", "{}");
    for (size_t i = 0; i < kRows; ++i) writer.Write(channel, Time(i), JointStateJson(i));
    writer.Finish();
  }
  const auto reader = OpenRecording(Path("a.mcap"));
  EXPECT_THAT(reader->names(), ElementsAre("time", "/joint_states.position.a", "/joint_states.position.b",
                                           "/joint_states.effort.a", "/joint_states.effort.b"));
  ExpectRows(reader.get());
  const std::string bytes = ReadBytes(Path("a.mcap"));
  EXPECT_THAT(MessageOfOpening(Write("cut.mcap", bytes.substr(0, bytes.size() / 4))),
              HasSubstr("cut.mcap: ends within"));
  EXPECT_THAT(MessageOf<InputError>([&] { return OpenRecording(Path("a.mcap"), "/other"); }),
              HasSubstr("has no topic \"/other\""));
}

/// sensor_msgs/msg/JointState in CDR.
class Cdr {
 public:
  explicit Cdr(size_t row) {
    Put(static_cast<std::int32_t>(Time(row)));
    Put(static_cast<std::uint32_t>(std::lround(1e9 * (Time(row) - std::floor(Time(row))))));
    Text("base");
    Put<std::uint32_t>(2);
    Text("a");
    Text("b");
    Numbers({Position(row, 0), Position(row, 1)});
    Numbers({});
    Numbers({Effort(row, 0), Effort(row, 1)});
  }
  [[nodiscard]] std::string bytes() const { return std::string("\0\1\0\0", 4) + bytes_; }

 private:
  template <typename Number>
  void Put(Number number) {
    while (bytes_.size() % sizeof number != 0) bytes_ += '\0';
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof number);
  }
  void Text(const std::string& text) {
    Put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_ += text + '\0';
  }
  void Numbers(const std::vector<double>& numbers) {
    Put(static_cast<std::uint32_t>(numbers.size()));
    for (const double number : numbers) Put(number);
  }
  std::string bytes_;
};

TEST_F(Formats, BagsOfRos2) {
  std::filesystem::create_directory(Path("bag"));
  {
    SQLite::Database bag(Path("bag/a.db3").string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    bag.exec("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)");
    bag.exec("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)");
    bag.exec("INSERT INTO topics VALUES(1, '/tf', 'tf2_msgs/msg/TFMessage', 'cdr')");
    bag.exec("INSERT INTO topics VALUES(2, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr')");
    for (size_t i = 0; i < kRows; ++i) {
      SQLite::Statement insert(bag, "INSERT INTO messages(topic_id, timestamp, data) VALUES(2, ?, ?)");
      const std::string bytes = Cdr(i).bytes();
      insert.bind(1, static_cast<std::int64_t>(i));
      insert.bind(2, bytes.data(), static_cast<int>(bytes.size()));
      insert.exec();
    }
  }
  const auto reader = OpenRecording(Path("bag"));
  EXPECT_THAT(reader->names(), ElementsAre("time", "position.a", "position.b", "effort.a", "effort.b"));
  ExpectRows(reader.get());
}

TEST(JointState, CutShortIsRefusedAtEveryLength) {
  const std::string whole = Cdr(1).bytes();
  EXPECT_EQ(ParseJointState(whole, "m").fields.size(), 4U);
  for (size_t length = 0; length < whole.size(); ++length)
    EXPECT_THROW((void)ParseJointState(whole.substr(0, length), "m"), InputError) << length;
}

NpyArray Array(size_t width, double (*value)(size_t row, size_t column)) {
  NpyArray array;
  array.shape = {kRows};
  if (width > 1) array.shape.push_back(width);
  for (size_t i = 0; i < kRows; ++i)
    for (size_t k = 0; k < width; ++k) array.values.push_back(value(i, k));
  return array;
}

TEST(JointState, JsonOfOtherShapesIsRefusedOrLeftOut) {
  for (const char* const text :
       {R"([1])", R"({"name": ["a"], "position": 3})", R"({"name": ["a"], "position": {"x": 1}})",
        R"({"name": [1], "position": [1]})", R"({"name": ["a"], "position": [1, 2]})"})
    EXPECT_THROW(ParseJsonMessage(text, 0.0, "bag"), InputError) << text;
  for (const char* const stamp : {R"(5)", R"({"stamp": 5})", R"({"stamp": {"sec": "5"}})", R"([1])"})
    EXPECT_EQ(ParseJsonMessage(std::string(R"({"name": ["a"], "position": [1], "header": )") + stamp + "}",
                               7.0, "bag")
                  .time,
              7.0)
        << stamp;
}

TEST_F(Formats, NumPy) {
  int error = 0;
  zip_t* archive = zip_open(Path("a.npz").c_str(), ZIP_CREATE, &error);
  std::vector<std::string> texts = {WriteNpy(Array(1, [](size_t row, size_t) { return Time(row); })),
                                    WriteNpy(Array(2, Position)), WriteNpy(Array(2, Effort))};
  constexpr const char* kNames[] = {"t.npy", "q.npy", "tau.npy"};
  for (size_t i = 0; i < texts.size(); ++i)
    zip_file_add(archive, kNames[i], zip_source_buffer(archive, texts[i].data(), texts[i].size(), 0), 0);
  zip_close(archive);
  const auto reader = OpenRecording(Path("a.npz"));
  EXPECT_THAT(reader->names(), ElementsAre("t", "q[0]", "q[1]", "tau[0]", "tau[1]"));
  ExpectRows(reader.get());
  EXPECT_THAT(MessageOfOpening(Write("one.npy", texts[0])), HasSubstr("must have two indices"));
}

TEST_F(Formats, Hdf5OfOthers) {
  const hid_t file = H5Fcreate(Path("a.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const auto add = [&](const char* name, const NpyArray& array) {
    const hsize_t extents[2] = {kRows, array.shape.size() > 1 ? array.shape[1] : 1};
    const hid_t space = H5Screate_simple(static_cast<int>(array.shape.size()), extents, nullptr);
    const hid_t set = H5Dcreate2(file, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, array.values.data());
    H5Dclose(set);
    H5Sclose(space);
  };
  add("a_time", Array(1, [](size_t row, size_t) { return Time(row); }));
  add("q", Array(2, Position));
  add("tau", Array(2, Effort));
  H5Fclose(file);
  ExpectRows(OpenRecording(Path("a.h5")).get());
  EXPECT_THAT(MessageOfOpening(Write("cut.h5", ReadBytes(Path("a.h5")).substr(0, 600))),
              HasSubstr("cut.h5: cannot be read"));
}

TEST_F(Formats, ColumnsAreNamedInAFile) {
  const auto rows = Write("rows.txt", Rows(" "));
  const RobotModel model = MakeUnknownRobot(2);
  const auto open = [&](const std::string& toml) {
    return OpenRecordingOf(model, rows, Write("columns.toml", toml));
  };
  const Recording recording = open(
      "t = { columns = [1], unit = \"ms\" }\nq = { columns = [3, 2], joints = [\"joint 1\", \"joint 2\"], "
      "unit = \"deg\", sign = [1, -1], "
      "offset = 0.5 }\ntau = [4, 5]\n");
  ASSERT_EQ(recording.channels.size(), 5U);
  EXPECT_DOUBLE_EQ(recording.channels[0].scale, 1e-3);
  EXPECT_EQ(recording.FindColumn(RecordedQuantity::kPosition, 0), 2);
  EXPECT_DOUBLE_EQ(recording.channels[2].scale, -kPi / 180.0);
  EXPECT_DOUBLE_EQ(recording.channels[2].offset, 0.5);
  const auto forces = Write("columns.toml", "t = 1\n[[wrench]]\ncolumns = [3, 4, 5]\nlink = \"link 2\"\n");
  const Recording pushed = OpenRecordingOf(model, rows, forces, /*is_complete=*/false);
  ASSERT_EQ(pushed.wrenches.size(), 1U);
  EXPECT_EQ(pushed.channels.back().joint, 2) << "a force without a moment";
  EXPECT_THAT(DescribeColumns(model, pushed),
              HasSubstr("[[wrench]]\ncolumns = [3, 4, 5]\nlink = \"link 2\""));
  const std::string some = "t = 1\nq = [2]\ntau = [4]\n";
  for (const auto& [toml, message] : std::vector<std::pair<std::string, const char*>>{
           {"t = 1\nq = [2, 9]\ntau = [4, 5]\n",
            "columns.toml:2: q[1]: must be a whole number from 1 to 5, got 9"},
           {"t = 1\nq = { columns = [2], unit = \"kg\" }\ntau = [4]\n",
            "q.unit: must be a unit of q, got \"kg\""},
           {"t = 1\nq = { columns = [2], joints = [\"elbow\"] }\ntau = [4]\n", "must be a joint of"},
           {"t = 1\nq = [2]\ntau = [2]\n", "column 2 is both q and tau"},
           {"t = 1\nq = [2]\n", "has no column that is known as a joint's torque"},
           {some + "torque = [5]\n", "torque"},
           {some + "wrench = [3]\n", "wrench: must be a table, with a link"},
           {some + "wrench = { columns = [3, 5], link = \"link 2\" }\n", "wrench.columns: must be 6 columns"},
           {some + "wrench = { columns = [3], link = \"hand\" }\n", "wrench.link: must be a moving link of"},
           {some + "wrench = { columns = [3], link = \"link 2\", axes = \"tool\" }\n",
            "wrench.axes: must be \"link\" or \"world\""},
           {some + "base = [3, 5]\n", "base: must be 7 columns"}})
    EXPECT_THAT(MessageOf<InputError>([&, text = toml] { return open(text); }), HasSubstr(message));
}

}  // namespace
}  // namespace dexcheck::testing::recording_reader_test
