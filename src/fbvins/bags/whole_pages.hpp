// SPDX-License-Identifier: Apache-2.0
// Private to bags: SQLite's files without the part of a page that a cut leaves at their end, which SQLite would fill with zeros
// and take for messages.
#pragma once

namespace fbvins {

/// The name of such a way to files, for sqlite3_open_v2(); nullptr where SQLite has none of its own. Any thread.
const char* whole_pages_vfs();

}  // namespace fbvins
