// SPDX-License-Identifier: Apache-2.0
// Private to bags: SQLite files without the incomplete page that a cut leaves at their end, which SQLite would fill with zeros
// and take for messages.
#pragma once

namespace fbvins {

/// Name of an SQLite VFS that hides that page, for sqlite3_open_v2(); nullptr where SQLite has no default VFS. Any thread.
const char* whole_pages_vfs();

}  // namespace fbvins
