// SPDX-License-Identifier: Apache-2.0
/// A plugin of qemu-user (7 or later) for bench/instructions: counts the instructions of one thread below a function, image by
/// image.
///   qemu-aarch64 -plugin count_arm64.so,watch=FILE,out=FILE,skip=N PROGRAM ...
/// `watch` has a line "OFFSET STAGE" for each function of interest: its place in the program's file, and a small number: 0 is the
/// function below which is counted, 1 the one whose end is the end of an image, others are stages. `out` gets, after N images, a
/// line of counts for each image (all, then each stage), and at the end "block OFFSET COUNT" for each block of instructions.
///
/// A block of instructions ends with every branch, so the calls are followed by the last instruction of the block before.
#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <unordered_map>
#include <vector>

// The part of qemu's interface for plugins, version 1, that is used here.
extern "C" {
struct qemu_info_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
using Id = uint64_t;
void qemu_plugin_register_vcpu_tb_trans_cb(Id, void (*)(Id, qemu_plugin_tb*));
void qemu_plugin_register_vcpu_tb_exec_cb(qemu_plugin_tb*, void (*)(unsigned, void*), int, void*);
void qemu_plugin_register_atexit_cb(Id, void (*)(Id, void*), void*);
size_t qemu_plugin_tb_n_insns(const qemu_plugin_tb*);
uint64_t qemu_plugin_tb_vaddr(const qemu_plugin_tb*);
qemu_plugin_insn* qemu_plugin_tb_get_insn(const qemu_plugin_tb*, size_t);
const void* qemu_plugin_insn_data(const qemu_plugin_insn*);
uint64_t qemu_plugin_start_code();
extern int qemu_plugin_version;
int qemu_plugin_version = 1;
}

namespace {

constexpr int kStages = 16, kCounted = 0, kImage = 1;

enum class End { other, call, back };

struct Block {
  uint64_t begin = 0, end = 0, length = 0, count = 0;
  End kind = End::other;
  int stage = -1;
};

struct Live {  // a function that runs
  int stage;
  size_t depth;  // of the calls, when it was entered
};

struct Thread {
  const Block* last = nullptr;
  std::vector<uint64_t> calls;  // addresses to come back to
  std::vector<Live> live;
  std::array<bool, kStages> in{};
};

std::array<Thread, 256> threads;
std::map<std::pair<uint64_t, uint64_t>, Block> blocks;  // qemu translates on one thread at a time
std::unordered_map<uint64_t, int> watched;
std::array<uint64_t, kStages> counts{};
int skip = 0;
FILE* out = nullptr;

End end_of(uint32_t instruction) {
  if ((instruction & 0xFC000000u) == 0x94000000u || (instruction & 0xFFFFFC1Fu) == 0xD63F0000u) return End::call;  // bl, blr
  return (instruction & 0xFFFFFC1Fu) == 0xD65F0000u ? End::back : End::other;                                      // ret
}

void end_image() {
  if (skip == 0) {
    for (const uint64_t c : counts) std::fprintf(out, "%" PRIu64 " ", c);
    std::fprintf(out, "\n");
  } else if (--skip == 0) {
    for (auto& [place, block] : blocks) block.count = 0;
  }
  counts.fill(0);
}

/// Keeps the calls of a thread, and ends functions that were left.
void follow(Thread& thread, const Block& block) {
  if (thread.last && thread.last->kind == End::call) thread.calls.push_back(thread.last->end);
  if (!thread.last || thread.last->kind != End::back) return;
  const auto found = std::find(thread.calls.rbegin(), thread.calls.rend(), block.begin);  // an exception leaves several at once
  if (found == thread.calls.rend()) return;
  thread.calls.erase(found.base() - 1, thread.calls.end());
  while (!thread.live.empty() && thread.live.back().depth > thread.calls.size()) {
    const int stage = thread.live.back().stage;
    thread.in[stage] = false;
    thread.live.pop_back();
    if (stage == kImage) end_image();
  }
}

void execute(unsigned cpu, void* data) {
  Block& block = *static_cast<Block*>(data);
  Thread& thread = threads[cpu % threads.size()];
  follow(thread, block);
  thread.last = &block;
  if (block.stage >= 0 && !thread.in[block.stage] && (block.stage == kCounted || thread.in[kCounted])) {
    thread.in[block.stage] = true;
    thread.live.push_back({block.stage, thread.calls.size()});
  }
  if (!thread.in[kCounted]) return;
  block.count += block.length;
  for (const Live& l : thread.live) counts[l.stage] += block.length;
}

void translate(Id, qemu_plugin_tb* tb) {
  const uint64_t begin = qemu_plugin_tb_vaddr(tb), length = qemu_plugin_tb_n_insns(tb);
  Block& block = blocks[{begin, length}];
  uint32_t last = 0;
  std::memcpy(&last, qemu_plugin_insn_data(qemu_plugin_tb_get_insn(tb, length - 1)), sizeof(last));
  const auto stage = watched.find(begin - qemu_plugin_start_code());
  block = {begin, begin + 4 * length, length, block.count, end_of(last), stage == watched.end() ? -1 : stage->second};
  qemu_plugin_register_vcpu_tb_exec_cb(tb, execute, 0, &block);
}

void finish(Id, void*) {
  for (const auto& [place, block] : blocks) {
    if (block.count)
      std::fprintf(out, "block %" PRId64 " %" PRIu64 "\n", static_cast<int64_t>(block.begin - qemu_plugin_start_code()),
                   block.count);
  }
  std::fclose(out);
}

}  // namespace

extern "C" int qemu_plugin_install(Id id, const qemu_info_t*, int count, char** arguments) {
  for (int i = 0; i < count; ++i) {
    const char* value = std::strchr(arguments[i], '=');
    if (!value) return 1;
    ++value;
    if (!std::strncmp(arguments[i], "skip=", 5)) skip = static_cast<int>(std::strtol(value, nullptr, 10));
    if (!std::strncmp(arguments[i], "out=", 4)) out = std::fopen(value, "w");
    if (!std::strncmp(arguments[i], "watch=", 6)) {
      FILE* file = std::fopen(value, "r");
      uint64_t place = 0;
      int stage = 0;
      while (file && std::fscanf(file, "%" SCNu64 " %d", &place, &stage) == 2) watched[place] = stage;
      if (file) std::fclose(file);
    }
  }
  if (!out || watched.empty()) return 1;
  qemu_plugin_register_vcpu_tb_trans_cb(id, translate);
  qemu_plugin_register_atexit_cb(id, finish, nullptr);
  return 0;
}
