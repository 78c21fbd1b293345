/* interrupt.exe EVENT PROGRAM [ARGUMENT...]
 *
 * Runs a program with a console, sends it Ctrl-C (`c`) or Ctrl-Break (`break`) when a line arrives on standard input, and ends as
 * the program ends. Rust's standard library cannot send these. */
#include <stdio.h>
#include <string.h>
#include <wchar.h>
#include <windows.h>

static BOOL WINAPI ignore(DWORD event) {
    (void)event;
    return TRUE;
}

int wmain(int count, wchar_t **arguments) {
    if (count < 3) return 2;
    /* The command line after this program's name, which may be quoted, and after the event. */
    wchar_t *program = GetCommandLineW();
    program = *program == '"' ? wcschr(program + 1, '"') + 1 : program + wcscspn(program, L" ");
    program += wcsspn(program, L" ") + wcslen(arguments[1]);
    program += wcsspn(program, L" ");
    BOOL is_break = wcscmp(arguments[1], L"break") == 0;
    STARTUPINFOW startup = {sizeof startup};
    startup.dwFlags = STARTF_USESTDHANDLES;
    startup.hStdInput = INVALID_HANDLE_VALUE;
    startup.hStdOutput = GetStdHandle(STD_OUTPUT_HANDLE);
    startup.hStdError = GetStdHandle(STD_ERROR_HANDLE);
    PROCESS_INFORMATION process;
    FreeConsole();
    AllocConsole();
    /* In a group of its own Ctrl-C is ignored, so that one goes to this process too. */
    SetConsoleCtrlHandler(NULL, FALSE);
    if (!CreateProcessW(NULL, program, NULL, NULL, TRUE, is_break ? CREATE_NEW_PROCESS_GROUP : 0, NULL, NULL, &startup, &process)) return 3;
    SetConsoleCtrlHandler(ignore, TRUE);
    char input[16];
    if (fgets(input, sizeof input, stdin)) {
        if (!GenerateConsoleCtrlEvent(is_break ? CTRL_BREAK_EVENT : CTRL_C_EVENT, is_break ? process.dwProcessId : 0)) {
            TerminateProcess(process.hProcess, 1);
            return 4; /* Wine 8 sends no Ctrl-Break. */
        }
    }
    WaitForSingleObject(process.hProcess, INFINITE);
    DWORD code;
    GetExitCodeProcess(process.hProcess, &code);
    return (int)code;
}
