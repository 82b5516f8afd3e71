@echo off
rem Install ALUP Reshape for the Inkscape of this user: install.cmd --help
rem All is done by alup\setup, in Python; this file finds one for it. Inkscape's own will do.
setlocal
set "setup=%~dp0alup\setup"
set "python="
for %%P in ("%ProgramW6432%\Inkscape\bin\python.exe" "%ProgramFiles%\Inkscape\bin\python.exe" "%LOCALAPPDATA%\Programs\Inkscape\bin\python.exe") do if not defined python if exist %%P set "python=%%~P"
if defined INKSCAPE_COMMAND for %%P in ("%INKSCAPE_COMMAND%") do if exist "%%~dpPpython.exe" set "python=%%~dpPpython.exe"
if defined python goto found
where /q py.exe && set "python=py.exe"
if defined python goto found
where /q python.exe && set "python=python.exe"
if defined python goto found
echo install.cmd: no Python was found; install Inkscape from inkscape.org first 1>&2
if "%~1"=="" pause
exit /b 1
:found
"%python%" -E -s -B "%setup%" %*
set "code=%ERRORLEVEL%"
if "%~1"=="" pause
exit /b %code%
